// Poses as they are learned with the Gaussians, and cameras tracked against a model that stays as it is.
#include <gart/runtime/compiled_renderer.hpp>
#include <gart/runtime/track.hpp>
#include <train/runs.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

using namespace gart_test;

namespace {

double const degree = std::acos(-1.0) / 180;

double degrees_between(gart::camera const& a, gart::camera const& b) {
  return glm::length(gart::angles_of(glm::transpose(gart::axes_of(a)) * gart::axes_of(b))) / degree;
}

// Turned and shifted by so much, in directions drawn at random.
gart::camera disturbed(gart::camera const& c, std::mt19937_64& random, double degrees, double shift) {
  std::normal_distribution<double> normal;
  auto const direction = [&] {
    gart::vec3d const v(normal(random), normal(random), normal(random));
    return v / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  };
  gart::vec3d const t = direction() * shift, w = direction() * (degrees * degree);
  return gart::moved(c, {t.x, t.y, t.z, w.x, w.y, w.z}, 1);
}

gart::train_options learning_poses(int iterations) {
  gart::train_options options = still(iterations);
  options.refine_poses = true;
  options.poses.warm_up = 0;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("disturbed poses are found again, and images agree", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  auto data = capture(exec, seed);
  data.extent = 4;
  std::vector<gart::camera> truth;
  for (auto& v : data.train) truth.push_back(v.view);
  // Two views, by one turn there and back in the world: of that no similarity of all is a part, which would stay.
  std::normal_distribution<double> normal;
  gart::vec3d const axis(normal(random), normal(random), normal(random)), turn = glm::normalize(axis) * degree;
  double before = 0, after = 0;
  for (std::size_t const v : {std::size_t{1}, std::size_t{2}}) {
    gart::vec3d const w = glm::transpose(gart::axes_of(truth[v])) * turn * (v == 1 ? 1.0 : -1.0);
    data.train[v].view = gart::moved(truth[v], {0, 0, 0, w.x, w.y, w.z}, 1);
    before = degrees_between(truth[v], data.train[v].view);
  }
  auto const options = learning_poses(480);
  run_of<E> run(exec, options, data, cloud(seed, 0.6f));
  double first = 0, last = 0;
  for (int k = 0; k < 4; ++k) first += double{run.step().psnr} / 4;
  while (run.steps_done() < options.iterations - 4) run.step();
  for (int k = 0; k < 4; ++k) last += double{run.step().psnr} / 4;
  auto const poses = run.poses();
  REQUIRE(poses.size() == 4);
  for (std::size_t v = 0; v < 4; ++v) {
    CHECK(poses[v].name == data.train[v].name);
    after = std::max(after, degrees_between(truth[v], poses[v].view));
  }
  CHECK(before == doctest::Approx(1).epsilon(0.01));
  CHECK(after < 0.1);
  CHECK(last > first + 3);
  MESSAGE(std::string(E::name) << ": the farthest view is off by " << after << " degrees, PSNR " << first << " to "
                               << last);
}

TEST_CASE_TEMPLATE("a state carries poses; other numbers of views are refused", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto data = capture(exec, seed);
  auto const options = learning_poses(40);
  run_of<E> run(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) run.step();
  auto const state = run.state();
  CHECK(words(state, "pose/visits").size() == 4);
  CHECK(doubles(state, "pose/metric")[0] > 0);
  run_of<E> other(exec, options, data, cloud(seed + 1, 0.6f));
  other.set_state(state);
  CHECK(doubles(other.state(), "pose") == doubles(state, "pose"));
  CHECK(doubles(other.state(), "pose/metric") == doubles(state, "pose/metric"));
  float const next = run.step().loss, again = other.step().loss;
  CHECK(again == doctest::Approx(next).epsilon(1e-4));
  // Over the end of an epoch, where the similarity of all views is taken out of them, in both runs at one step.
  for (int i = 0; i < 6; ++i) run.step(), other.step();
  double apart = 0;
  for (std::size_t i = 0; i < doubles(state, "pose").size(); ++i)
    apart = std::max(apart, std::abs(doubles(other.state(), "pose")[i] - doubles(run.state(), "pose")[i]));
  CHECK(apart <= (std::is_same_v<E, gart::serial_exec> ? 0.0 : 1e-5));
  data.train.pop_back();
  run_of<E> fewer(exec, options, data, cloud(seed + 1, 0.6f));
  CHECK_THROWS_WITH_AS(fewer.set_state(state), doctest::Contains("array pose has"), gart::invalid_argument);
}

TEST_CASE("the similarity of all views is taken out of increments") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<gart::camera> views(7);
  for (auto& c : views) {
    c.width = c.height = 4, c.fx = c.fy = 4;
    c.position = {3 * normal(random), 3 * normal(random), 3 * normal(random)};
    c = disturbed(c, random, 80, 0);
  }
  gart::pose_training poses({}, views, 5);
  // Increments that are a similarity of all alone.
  auto const state_now = [&] {
    gart::named_arrays all;
    poses.save(all);
    return all;
  };
  gart::named_arrays state = state_now();
  auto values = state.get<double>("pose");
  auto visits = state.get<gart::u32>("pose/visits");
  gart::vec3d const shift(1e-4, -2e-4, 3e-4), turn(2e-4, 1e-4, -1e-4);
  for (std::size_t i = 0; i < views.size(); ++i) {
    gart::vec3d const arm = views[i].position / 5.0;
    gart::mat3d const back = glm::transpose(gart::axes_of(views[i]));
    gart::vec3d const t = back * (shift + glm::cross(turn, arm) + arm * 3e-4), w = back * turn;
    for (int k = 0; k < 3; ++k) {
      values[6 * i + static_cast<std::size_t>(k)] = t[k];
      values[6 * i + 3 + static_cast<std::size_t>(k)] = w[k];
    }
    visits[i] = i == 0 ? 7 : 1;
  }
  visits[0] = 6;  // one more visit, and all have been visited once more
  state.set("pose", values), state.set("pose/visits", visits);
  poses.load(state);
  gart::pose_gradient nothing;
  nothing.translation = gart::vec3d(std::numeric_limits<double>::quiet_NaN());
  poses.step(0, nothing, 10, 100);  // not finite: moves nothing, and is no visit
  CHECK(state_now().bytes == state.bytes);
  double largest = 0;
  for (int visit = 0; visit < 7 && largest == 0; ++visit) {
    poses.step(0, {}, 10, 100);
    // Until then the pull to the capture moves view 0 alone.
    auto const now = state_now().get<double>("pose");
    if (now[6] != values[6])
      for (std::size_t k = 6; k < now.size(); ++k) largest = std::max(largest, std::abs(now[k]));
  }
  CHECK(largest > 0);
  CHECK(largest < 1.5e-2);
}

TEST_CASE_TEMPLATE("a camera is tracked from 2 degrees off to 0.02", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  auto const data = capture(exec, seed);
  gart::camera truth = gart::resized(data.train[0].view, 58, 44);
  gart::compiled_renderer<E, gart::scene_traits<1>, gart::tile_tracer<E>, gart::pixel_method> renderer(
      {.sh_degree = 1});
  renderer.set_model(cloud(seed, 0.6f));
  CHECK_THROWS_AS(renderer.differentiate_pose(), gart::invalid_argument);
  gart::track_options options;
  options.response.exposed.m[0] = 0.8f, options.response.exposed.m[7] = 0.1f;
  options.response.falloff.k[0] = -0.4f, options.response.circle = gart::image_circle(truth);
  auto photo = renderer.render(truth, options.render).color;
  gart::apply(options.response, photo);
  for (int trial = 0; trial < 3; ++trial) {
    gart::camera const guess = disturbed(truth, random, 2, 0.05 * 4);
    auto const found = gart::track(renderer, photo, guess, options);
    CHECK(found.residuals.size() <= 60);
    CHECK(found.residuals.back() < 0.1f * found.residuals.front());
    CHECK(degrees_between(truth, found.view) < 0.02);
    CHECK(glm::length(found.view.position - truth.position) < 5e-4 * 4);
  }
  CHECK_THROWS_AS(gart::track(renderer, gart::image_float(3, 3, 3), truth, options), gart::invalid_argument);
  options.steps = 0;
  CHECK_THROWS_AS(gart::track(renderer, photo, truth, options), gart::invalid_argument);
}
