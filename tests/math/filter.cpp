// The filter of a pixel and what it makes of a Gaussian, against solid angles of pixels and areas in double, with the
// gradients of both against differences.
#include <gart/camera/models.hpp>
#include <support/policies.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

class source {
 public:
  explicit source(std::uint64_t seed) : random_(seed) {}
  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  double normal() { return std::normal_distribution<double>()(random_); }
  Vector3d direction() { return Vector3d(normal(), normal(), normal()).normalized(); }

  gart::camera camera(bool lens) {
    gart::camera c;
    c.width = 640, c.height = 480;
    c.fx = static_cast<float>(uniform(300, 900)), c.fy = c.fx * static_cast<float>(uniform(0.8, 1.2));
    c.cx = static_cast<float>(uniform(280, 360)), c.cy = static_cast<float>(uniform(200, 280));
    if (lens)
      c.lens = {static_cast<float>(uniform(-0.1, 0.1)), static_cast<float>(uniform(0, 0.03)),
                static_cast<float>(uniform(-0.01, 0.01)), static_cast<float>(uniform(-0.01, 0.01))};
    c.rotation = gart::to_matrix({float(normal()), float(normal()), float(normal()), float(normal())});
    c.position = {uniform(-100, 100), uniform(-100, 100), uniform(-100, 100)};
    return c;
  }

 private:
  std::mt19937_64 random_;
};

Matrix3d camera_axes(gart::camera const& c) {
  Matrix3d r;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) r(row, column) = c.rotation[column][row];
  return r;
}

Vector2d distorted(gart::camera const& c, Vector2d const& p) {
  double const x = p.x(), y = p.y(), r2 = p.squaredNorm(), k = 1 + r2 * (c.lens.k1 + r2 * c.lens.k2);
  double const p1 = c.lens.p1, p2 = c.lens.p2;
  return {x * k + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * k + 2 * p2 * x * y + p1 * (r2 + 2 * y * y)};
}

// Unit direction, in camera axes, of an image point: the slopes found by fixed-point steps.
Vector3d direction_of(gart::camera const& c, Vector2d const& point) {
  Vector2d const target((point.x() - c.cx) / c.fx, (point.y() - c.cy) / c.fy);
  Vector2d p = target;
  for (int k = 0; k < 400; ++k) p += target - distorted(c, p);
  return Vector3d(p.x(), p.y(), 1).normalized();
}

// The angle of a pixel about the image point that shows `m`: the root of the solid angle of a tenth of its width.
double pixel_angle(gart::camera const& c, Vector3d const& m) {
  Vector3d const q = camera_axes(c).transpose() * m;
  Vector2d const slopes = distorted(c, {q.x() / q.z(), q.y() / q.z()});
  Vector2d const at(slopes.x() * c.fx + c.cx, slopes.y() * c.fy + c.cy);
  double const half = 0.05;
  std::array<Vector3d, 4> corner;
  for (std::size_t k = 0; k < 4; ++k)
    corner[k] = direction_of(c, at + half * Vector2d(k == 1 || k == 2 ? 1 : -1, k >= 2 ? 1 : -1));
  auto const triangle = [](Vector3d const& a, Vector3d const& b, Vector3d const& d) {
    return 2 * std::atan2(std::abs(a.dot((b - a).cross(d - a))), 1 + a.dot(b) + b.dot(d) + d.dot(a));
  };
  double const solid = triangle(corner[0], corner[1], corner[2]) + triangle(corner[0], corner[2], corner[3]);
  return std::sqrt(solid) / (2 * half);
}

// mean, log-scale, quaternion, logit
using parameters = std::array<double, 11>;

struct seen {
  double log_scale[3], log_sigma;
};

// By the areas that a plane across the view sees.
seen seen_through(parameters const& p, double r) {
  Matrix3d const turn = Eigen::Quaterniond(p[6], p[7], p[8], p[9]).normalized().toRotationMatrix();
  Vector3d const d = Vector3d(p[0], p[1], p[2]).normalized();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = d.unitOrthogonal(), across.col(1) = d.cross(across.col(0));
  Vector3d squares;
  seen out;
  for (int k = 0; k < 3; ++k) {
    squares[k] = std::exp(2 * p[static_cast<std::size_t>(3 + k)]);
    out.log_scale[k] = 0.5 * std::log(squares[k] + r * r);
  }
  // The shadow of the axes, and beside them the filter's two: by Cauchy and Binet the determinant of their covariance
  // is the sum of the squares of all areas that two of them span, of which thin ones lose no digits.
  Eigen::Matrix<double, 2, 5> half;
  half << across.transpose() * turn * squares.cwiseSqrt().asDiagonal(), r * Eigen::Matrix2d::Identity();
  double narrow = 0, wide = 0;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < i; ++j) {
      double const area = half(0, i) * half(1, j) - half(1, i) * half(0, j);
      wide += area * area;
      if (i < 3) narrow += area * area;
    }
  out.log_sigma = 0.5 * std::log(narrow / wide) - std::log1p(std::exp(-p[10]));
  return out;
}

gart::gaussian_parameters stored(parameters const& p) {
  auto const f = [&](std::size_t k) { return static_cast<float>(p[k]); };
  return {{f(0), f(1), f(2)}, {f(3), f(4), f(5)}, {f(6), f(7), f(8), f(9)}, f(10)};
}

gart::vec3 to_vec3(Vector3d const& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// Scales from a thousandth to a thousand times r, together or apart.
parameters gaussian(source& from, double r) {
  parameters p;
  Vector3d const mean = from.uniform(1, 10) * from.direction();
  double const size = from.uniform(-7, 7);
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = mean[static_cast<int>(k)];
    p[3 + k] = std::log(r) + std::clamp(size + from.uniform(-2, 2), -7.0, 7.0);
  }
  for (std::size_t k = 0; k < 4; ++k) p[6 + k] = from.normal();
  p[10] = from.uniform(-4, 8);
  for (double& v : p) v = static_cast<float>(v);
  return p;
}

}  // namespace

TEST_CASE("a filter is as wide as a pixel reaches through any lens") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed());
  double worst = 0, worst_slope = 0;
  for (int trial = 0; trial < 200; ++trial) {
    gart::camera const c = from.camera(trial % 2 == 1);
    double const pixels = from.uniform(0.1, 2);
    Matrix3d const axes = camera_axes(c);
    gart::visit_camera(c, [&](auto const& model) {
      auto const filter = model.filter(static_cast<float>(pixels));
      for (int k = 0; k < 10; ++k) {
        Vector2d const at(from.uniform(10, c.width - 10), from.uniform(10, c.height - 10));
        Vector3d const m =
            (axes * direction_of(c, at) * from.uniform(0.1, 50)).template cast<float>().template cast<double>();
        gart::filter_at const got = filter.at(to_vec3(m));
        auto const sigma = [&](Vector3d const& v) { return pixels * pixel_angle(c, v) * v.norm(); };
        worst = std::max(worst, std::abs(got.sigma / sigma(m) - 1));
        Vector3d expected;
        double const h = 1e-3 * m.norm();
        for (int a = 0; a < 3; ++a) {
          Vector3d const e = h * Vector3d::Unit(a);
          expected[a] = (std::log(sigma(m + e)) - std::log(sigma(m - e))) / (2 * h);
        }
        Vector3d const slope(got.log_slope.x, got.log_slope.y, got.log_slope.z);
        worst_slope = std::max(worst_slope, (slope - expected).norm() * m.norm());
      }
    });
  }
  CAPTURE(worst);
  CAPTURE(worst_slope);
  CHECK(worst < 1e-5);
  CHECK(worst_slope < 1e-4);
}

TEST_CASE("beside and behind the image a filter is its border's") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed() + 1);
  for (int trial = 0; trial < 200; ++trial) {
    gart::camera const c = from.camera(trial % 2 == 1);
    gart::vec3 const m = to_vec3(from.uniform(0.01, 100) * from.direction());
    float behind = 0;
    gart::filter_at const got = gart::visit_camera(c, [&](auto const& model) {
      behind = model.filter(0.3f).sigma_at(-m);
      return model.filter(0.3f).at(m);
    });
    float const distance = std::sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
    CHECK(got.sigma > 0.1f * 0.3f * distance / c.fx);
    CHECK(got.sigma < 1.5f * 0.3f * distance / c.fx);
    for (int k = 0; k < 3; ++k) CHECK(gart::is_finite(got.log_slope[k]));
    CHECK(behind > 0);
  }
  CHECK(gart::pinhole(from.camera(false)).filter(0.3f).at(gart::vec3(0.0f)).sigma == 0);
}

TEST_CASE("a widened Gaussian covers its old extent plus the filter") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed() + 2);
  double worst_scale = 0, worst_sigma = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    double const r = static_cast<float>(std::exp(from.uniform(-7, 2)));
    parameters const p = gaussian(from, r);
    auto const g = gart::widened(stored(p), stored(p).mean, static_cast<float>(r));
    seen const e = seen_through(p, r);
    for (int k = 0; k < 3; ++k) worst_scale = std::max(worst_scale, std::abs(g.log_scale[k] - e.log_scale[k]));
    worst_sigma = std::max(worst_sigma, std::abs(gart::sigmoid(g.opacity) / std::exp(e.log_sigma) - 1));
  }
  CAPTURE(worst_scale);
  CAPTURE(worst_sigma);
  CHECK(worst_scale < 2e-6);
  CHECK(worst_sigma < 2e-5);
}

TEST_CASE("a filter acts most along a Gaussian's shortest axis") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed() + 5);
  for (int trial = 0; trial < 300; ++trial) {
    double const r = static_cast<float>(std::exp(from.uniform(-7, 2)));
    parameters p = gaussian(from, r);
    auto const share = [&](Vector3d const& direction) {
      parameters q = p;
      for (std::size_t k = 0; k < 3; ++k) q[k] = 3 * direction[static_cast<int>(k)];
      return std::exp(seen_through(q, r).log_sigma + std::log1p(std::exp(-p[10])));
    };
    gart::gaussian_parameters const g = stored(p);
    double const most = gart::largest_share_left(g.log_scale, static_cast<float>(r));
    double seen = 0;
    for (int k = 0; k < 50; ++k) seen = std::max(seen, share(from.direction()));
    CHECK(seen <= most * (1 + 1e-5));
    gart::mat3 const turn = gart::to_matrix(g.rotation);
    for (int k = 0; k < 3; ++k) seen = std::max(seen, share(Vector3d(turn[k].x, turn[k].y, turn[k].z)));
    CHECK(seen == doctest::Approx(most).epsilon(2e-5));
  }
  CHECK(gart::largest_share_left(gart::vec3(2.0f), 0.0f) == 1);
  CHECK(gart::largest_share_left(gart::vec3(-INFINITY), 1.0f) == 0);
}

TEST_CASE("the filter's backward pass is the derivative of its forward") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed() + 3);
  constexpr struct {
    char const* name;
    std::size_t first, count;
  } groups[] = {{"mean", 0, 3}, {"log-scale", 3, 3}, {"quaternion", 6, 4}, {"opacity", 10, 1}};
  double difference[4] = {}, size[4] = {};
  for (int trial = 0; trial < 4000; ++trial) {
    double const r0 = std::exp(from.uniform(-5, 0));
    parameters const p = gaussian(from, r0);
    // r by any law of the mean: a power of its distance and a plane wave.
    Vector3d const mean(p[0], p[1], p[2]), wave = from.direction();
    auto const r_at = [&](Vector3d const& m) {
      return r0 * std::pow(m.norm() / mean.norm(), 1.3) * std::exp(0.4 * wave.dot(m - mean));
    };
    Vector3d const slope = 1.3 * mean / mean.squaredNorm() + 0.4 * wave;
    double weight[4];
    for (double& w : weight) w = from.uniform(-1, 1);
    auto const loss = [&](parameters const& at) {
      seen const s = seen_through(at, r_at({at[0], at[1], at[2]}));
      return weight[0] * s.log_scale[0] + weight[1] * s.log_scale[1] + weight[2] * s.log_scale[2] +
             weight[3] * s.log_sigma;
    };
    gart::filter_at filter{static_cast<float>(r0), to_vec3(slope)};
    gart::geometry_gradient by{gart::vec3(0.0f), to_vec3({weight[0], weight[1], weight[2]}), {0, 0, 0, 0}, 0};
    auto const got = gart::pull_back_widened(by, static_cast<float>(weight[3]), stored(p), stored(p).mean, filter);
    double const all[11] = {got.mean.x,      got.mean.y,      got.mean.z,     got.log_scale.x,
                            got.log_scale.y, got.log_scale.z, got.rotation.w, got.rotation.x,
                            got.rotation.y,  got.rotation.z,  got.opacity};
    // A quaternion's gradient goes as 1 / its norm.
    double const norm = Eigen::Vector4d(p[6], p[7], p[8], p[9]).norm();
    for (std::size_t g = 0; g < 4; ++g)
      for (std::size_t k = groups[g].first; k < groups[g].first + groups[g].count; ++k) {
        double const unit = g == 2 ? norm : 1, h = 1e-5 * unit;
        parameters up = p, down = p;
        up[k] += h, down[k] -= h;
        double const expected = (loss(up) - loss(down)) / (2 * h);
        difference[g] += std::pow(unit * (all[k] - expected), 2), size[g] += std::pow(unit * expected, 2);
      }
  }
  for (std::size_t g = 0; g < 4; ++g) {
    INFO(std::string(groups[g].name));
    CHECK(std::sqrt(difference[g] / size[g]) < 1e-4);
  }
}

TEST_CASE("what is no Gaussian is left alone") {
  gart::gaussian_parameters const g{{0, 0, 2}, {0, 0, 0}, {1, 0, 0, 0}, 0};
  auto const same = [](gart::gaussian_parameters const& p, float r) {
    auto const w = gart::widened(p, p.mean, r);
    for (int k = 0; k < 3; ++k) CHECK(gart::float_to_bits(w.log_scale[k]) == gart::float_to_bits(p.log_scale[k]));
    CHECK(gart::float_to_bits(w.opacity) == gart::float_to_bits(p.opacity));
  };
  for (float const bad : {NAN, INFINITY, -INFINITY}) {
    auto p = g;
    p.mean.y = bad, same(p, 0.1f);
    p = g, p.log_scale.z = bad, same(p, 0.1f);
    p = g, p.rotation.x = bad, same(p, 0.1f);
    p = g, p.opacity = bad, same(p, 0.1f);
  }
  auto p = g;
  p.mean = gart::vec3(0.0f), same(p, 0.1f);
  p = g, same(p, 0.0f);
  // Too small to be seen at all: weaker than any threshold, and no NaN.
  p = g, p.log_scale = gart::vec3(-39.0f);
  CHECK(gart::hit_cutoff(gart::widened(p, p.mean, 10.0f), 1e-30f) < 0);
}
