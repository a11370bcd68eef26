// Lenses as they are learned with the Gaussians.
#include <gart/lens/lens_training.hpp>
#include <train/runs.hpp>

#include <cmath>
#include <limits>

using namespace gart_test;

namespace {

// A capture whose calibration says another focal length and centre than it was taken with.
template <class E>
gart::dataset miscalibrated(E& exec, std::uint64_t seed, float focal, float centre) {
  auto data = capture(exec, seed);
  data.extent = 4;
  for (auto& v : data.train)
    v.view.fx *= 1 + focal, v.view.fy *= 1 + focal, v.view.cx += centre * v.view.fx, v.view.cy -= centre * v.view.fy;
  return data;
}

gart::train_options learning_lenses(int iterations) {
  gart::train_options options = still(iterations);
  options.refine_lens = true;
  options.lens.warm_up = 0;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("a focal length 2 % off comes back to 0.2 %", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const truth = capture(exec, seed);
  for (float const off : {0.02f, -0.02f}) {
    CAPTURE(off);
    auto const data = miscalibrated(exec, seed, off, 0.01f);
    auto const options = learning_lenses(320);
    run_of<E> run(exec, options, data, cloud(seed, 0.6f));
    double first = 0, last = 0;
    for (int k = 0; k < 4; ++k) first += double{run.step().psnr} / 4;
    while (run.steps_done() < options.iterations - 4) run.step();
    for (int k = 0; k < 4; ++k) last += double{run.step().psnr} / 4;
    auto const cameras = run.poses();
    REQUIRE(cameras.size() == 4);
    for (auto const& c : cameras) {
      gart::camera const& own = truth.train[0].view;
      CHECK(std::abs(c.view.fx / own.fx - 1) < 0.002f);
      CHECK(c.view.fy / c.view.fx == doctest::Approx(own.fy / own.fx).epsilon(1e-6));
      CHECK(std::abs(c.view.cx - own.cx) < 0.002f * own.fx);
      CHECK(std::abs(c.view.cy - own.cy) < 0.002f * own.fy);
    }
    CHECK(last > first + 3);
    // A test view through the same camera is seen through what was learned; one through another stays as it is.
    gart::camera test = data.train[0].view;
    test.position.x += 1;
    CHECK(run.as_learned(test).fx == cameras[0].view.fx);
    CHECK(run.as_learned(test).position.x == test.position.x);
    test.fx *= 1.5f;
    CHECK(run.as_learned(test).fx == test.fx);
    MESSAGE(std::string(E::name) << ": off by " << 100 * (cameras[0].view.fx / 30 - 1) << " %, PSNR " << first << " to "
                                 << last);
  }
}

TEST_CASE_TEMPLATE("a state carries lenses; one without is refused", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto data = miscalibrated(exec, seed, 0.02f, 0.0f);
  data.train[3].view.fx *= 1.1f;  // two cameras
  auto options = learning_lenses(40);
  run_of<E> run(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) run.step();
  auto const state = run.state();
  CHECK(words(state, "lens/visits").size() == 2);
  CHECK(words(state, "lens/visits")[0] + words(state, "lens/visits")[1] == 9);
  run_of<E> other(exec, options, data, cloud(seed + 1, 0.6f));
  other.set_state(state);
  CHECK(doubles(other.state(), "lens") == doubles(state, "lens"));
  float const next = run.step().loss, again = other.step().loss;
  CHECK(again == doctest::Approx(next).epsilon(1e-4));
  auto fewer = data;
  fewer.train.pop_back();
  run_of<E> one(exec, options, fewer, cloud(seed + 1, 0.6f));
  CHECK_THROWS_WITH_AS(one.set_state(state), doctest::Contains("array lens has"), gart::invalid_argument);
  auto const refused = [&](gart::dataset const& of, char const* what) {
    CHECK_THROWS_WITH_AS(run_of<E>(exec, options, of, cloud(seed, 0.6f)), doctest::Contains(what),
                         gart::invalid_argument);
  };
  options.render.antialias = 0.5f;
  refused(data, "antialias");
  options.render.antialias = 0;
  data.train[2].view.kind = gart::camera_kind::equirectangular;
  refused(data, "view 2 has no focal length");
}

TEST_CASE("non-finite gradients move no lens; none moves in warm-up") {
  gart::camera view;
  view.width = view.height = 4, view.fx = view.fy = 4;
  gart::lens_training lenses({}, {{"a", view}, {"b", view}});
  auto const visits = [&] {
    gart::named_arrays state;
    lenses.save(state);
    return state.get<gart::u32>("lens/visits");
  };
  CHECK(visits().size() == 1);
  gart::lens_gradient by;
  by.fx = std::numeric_limits<double>::quiet_NaN();
  lenses.step(0, by, 100, 1000);
  CHECK(visits()[0] == 0);
  CHECK(lenses.view(view).fx == 4);
  CHECK(!lenses.learns(19, 1000));
  CHECK(lenses.learns(20, 1000));
  by.fx = 1;
  lenses.step(1, by, 20, 1000);
  CHECK(lenses.view(view).fx < 4);
  CHECK(lenses.view(view).cx == 0);
}
