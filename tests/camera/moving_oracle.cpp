// A rolling shutter against the oracle, row by row: each row is that of a camera that stands where the row is read. The
// image, its gradients by every way to sum them, and the gradient of the pose of all rows together by differences.
#include <gart/backward/backward.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>
#include <support/relative_error.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <vector>

namespace {

constexpr int degree = 2;

struct rolling_scene {
  oracle::scene s;
  oracle::parameters m;
  Eigen::Vector3d spin, travel;  // over the whole image, in world axes

  explicit rolling_scene(std::uint64_t seed) : s(oracle::smooth_scene(seed, degree, 2.0f)), m(s.model) {
    s.options.near = 1e-3f;
    gart::camera& c = s.view;
    c = gart::resized(c, 21, 14);
    c.shutter = gart::shutter_kind::bottom_to_top;
    c.turn = {0.1f, -0.15f, 0.2f}, c.travel = {0.3f, 0.2f, -0.1f};
    Eigen::Matrix3d axes;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) axes(j, i) = c.rotation[i][j];
    spin = axes * Eigen::Vector3d(c.turn.x, c.turn.y, c.turn.z);
    travel = axes * Eigen::Vector3d(c.travel.x, c.travel.y, c.travel.z);
  }
  double time_of(int row) const { return 0.5 - (row + 0.5) / s.view.height; }
  gart::camera still() const {
    gart::camera c = s.view;
    c.shutter = gart::shutter_kind::global, c.turn = c.travel = gart::vec3(0.0f);
    return c;
  }
  // The motion of a row from the middle pose, and of all of them by `turn` about the position and `shift`.
  oracle::motion of(int row, Eigen::Vector3d const& turn, Eigen::Vector3d const& shift) const {
    auto const by = [](Eigen::Vector3d const& w) {
      return w.norm() > 0 ? Eigen::AngleAxisd(w.norm(), w.normalized()) : Eigen::AngleAxisd::Identity();
    };
    double const t = time_of(row);
    Eigen::AngleAxisd const all(by(turn) * by(spin * t));
    Eigen::Vector3d const w = all.angle() * all.axis(), p = by(turn) * (travel * t) + shift;
    return {{p.x(), p.y(), p.z()}, {w.x(), w.y(), w.z()}};
  }
  oracle::picture picture(Eigen::Vector3d const& turn = Eigen::Vector3d::Zero(),
                          Eigen::Vector3d const& shift = Eigen::Vector3d::Zero()) const {
    gart::camera const c = still();
    oracle::picture out{c.width, c.height, {}};
    for (int row = 0; row < c.height; ++row) {
      auto const whole = oracle::render(m, c, s.options, degree, of(row, turn, shift));
      auto const from = whole.pixels.begin() + row * c.width;
      out.pixels.insert(out.pixels.end(), from, from + c.width);
    }
    return out;
  }
};

struct results {
  std::vector<float> color;
  gart::gaussian_model gradients;
  gart::pose_gradient pose;
};

template <class Tracer, class Method, class E>
results by(E& exec, rolling_scene const& r, std::vector<float> const& weights) {
  using frame_type = gart::frame<E, gart::scene_traits<degree>, Tracer>;
  gart::gaussians<E> const scene(exec, r.s.model);
  gart::gaussians<E> gradients(exec, scene.size(), degree);
  frame_type frame(exec);
  gart::backward_pass<frame_type, Method> pass(exec);
  gart::buffer<float, E> color(exec, weights.size()), by_color(exec, weights);
  frame.prepare(scene.view(), r.s.view, r.s.options, degree);
  REQUIRE(pass.prepare(frame));
  pass.render(frame, {color.data()});
  gart::differentiate(frame, pass, by_color, gradients);
  return {color.to_host(), gradients.to_host(), gart::differentiate_pose(frame, std::as_const(gradients).view())};
}

}  // namespace

TEST_CASE_TEMPLATE("a rolling shutter's image and gradients match the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  rolling_scene const r(seed);
  auto const base = r.picture();
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  std::size_t const pixels = base.pixels.size(), width = static_cast<std::size_t>(base.width);
  double const h = 1e-4;
  std::vector<oracle::picture> moved;
  std::vector<bool> usable(pixels);
  for (std::size_t p = 0; p < pixels; ++p) usable[p] = !base.pixels[p].edge && !base.pixels[p].kink;
  for (int k = 0; k < 6; ++k)
    for (double const step : {h, -h}) {
      Eigen::Vector3d turn = Eigen::Vector3d::Zero(), shift = turn;
      (k < 3 ? shift[k] : turn[k - 3]) = step;
      moved.push_back(r.picture(turn, shift));
      for (std::size_t p = 0; p < pixels; ++p)
        usable[p] = usable[p] && oracle::same_branches(base.pixels[p], moved.back().pixels[p]);
    }
  REQUIRE(std::count(usable.begin(), usable.end(), true) > static_cast<long>(pixels / 2));
  std::vector<float> weights(3 * pixels);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = usable[i / 3] ? normal(random) : 0.0f;
  double by_pose[6];
  for (std::size_t k = 0; k < 6; ++k) {
    by_pose[k] = 0;
    for (std::size_t i = 0; i < weights.size(); ++i)
      by_pose[k] += weights[i] *
                    (moved[2 * k].pixels[i / 3].color[i % 3] - moved[2 * k + 1].pixels[i / 3].color[i % 3]) / (2 * h);
  }
  oracle::parameters expected = r.m;
  auto const groups = {&oracle::parameters::mean, &oracle::parameters::log_scale, &oracle::parameters::quaternion,
                       &oracle::parameters::opacity, &oracle::parameters::sh};
  for (auto const group : groups) std::fill((expected.*group).begin(), (expected.*group).end(), 0.0);
  for (int row = 0; row < base.height; ++row) {
    std::vector<double> own(weights.size());
    std::size_t const from = 3 * width * static_cast<std::size_t>(row);
    std::copy_n(weights.begin() + static_cast<std::ptrdiff_t>(from), 3 * width,
                own.begin() + static_cast<std::ptrdiff_t>(from));
    auto const part = oracle::gradients(r.m, gart::at_time(r.s.view, r.time_of(row)), r.s.options, degree, own);
    for (auto const group : groups)
      for (std::size_t i = 0; i < (part.*group).size(); ++i) (expected.*group)[i] += (part.*group)[i];
  }
  auto const check = [&](results const& got) {
    double worst = 0;
    for (std::size_t p = 0; p < pixels; ++p)
      for (std::size_t c = 0; c < 3; ++c)
        if (!base.pixels[p].edge)
          worst =
              std::max(worst, std::abs(got.color[3 * p + c] - base.pixels[p].color[c]) - 2 * base.pixels[p].rounding);
    CHECK(worst < 1e-5);
    CHECK(gart_test::relative_error(got.gradients.mean, expected.mean) < 1e-4);
    CHECK(gart_test::relative_error(got.gradients.log_scale, expected.log_scale) < 1e-4);
    CHECK(gart_test::relative_error(got.gradients.quaternion, expected.quaternion) < 1e-4);
    CHECK(gart_test::relative_error(got.gradients.opacity, expected.opacity) < 1e-4);
    CHECK(gart_test::relative_error(got.gradients.sh, expected.sh) < 1e-4);
    double error = 0, norm = 0;
    for (int k = 0; k < 6; ++k) {
      double const own = k < 3 ? got.pose.translation[k] : got.pose.rotation[k - 3];
      error += (own - by_pose[k]) * (own - by_pose[k]), norm += by_pose[k] * by_pose[k];
    }
    CHECK(std::sqrt(error / norm) < 1e-4);
  };
  check(by<gart::tile_tracer<E>, gart::primitive_method>(exec, r, weights));
  check(by<gart::tile_tracer<E>, gart::hybrid_method>(exec, r, weights));
  check(by<gart::bvh_tracer<E>, gart::pixel_method>(exec, r, weights));
  check(by<gart::bvh_tracer<E>, gart::primitive_method>(exec, r, weights));
}
