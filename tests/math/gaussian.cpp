// A ray and a Gaussian: t, response and alpha against double, and the gradients of alpha against differences in double.
#include <gart/bvh/box.hpp>
#include <gart/math/hit_gradient.hpp>
#include <support/policies.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <random>

namespace {

// mean 3, log-scale 3, quaternion 4 (w first), logit.
using parameters = std::array<double, 11>;

struct exact_response {
  double t, d2, alpha;
};

exact_response exactly(parameters const& p, Eigen::Vector3d const& origin, Eigen::Vector3d const& direction,
                       int degree = 2) {
  Eigen::Matrix3d const r = Eigen::Quaterniond(p[6], p[7], p[8], p[9]).normalized().toRotationMatrix();
  Eigen::Vector3d const inverse(std::exp(-p[3]), std::exp(-p[4]), std::exp(-p[5]));
  Eigen::Matrix3d const m = inverse.asDiagonal() * r.transpose();
  Eigen::Vector3d const o = m * (origin - Eigen::Vector3d(p[0], p[1], p[2])), d = m * direction;
  double const t = -o.dot(d) / d.dot(d), d2 = (o + t * d).squaredNorm();
  return {t, d2, std::exp(-4.5 * std::pow(std::sqrt(d2) / 3, degree)) / (1 + std::exp(-p[10]))};
}

gart::gaussian_parameters stored(parameters const& p) {
  auto const f = [&](int k) { return static_cast<float>(p[static_cast<std::size_t>(k)]); };
  return {{f(0), f(1), f(2)}, {f(3), f(4), f(5)}, {f(6), f(7), f(8), f(9)}, f(10)};
}

class source {
 public:
  explicit source(std::uint64_t seed) : random_(seed) {}
  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  Eigen::Vector3d direction() {
    std::normal_distribution<double> n;
    return Eigen::Vector3d(n(random_), n(random_), n(random_)).normalized();
  }
  // Values that floats hold exactly, so that both sides evaluate the same Gaussian.
  parameters gaussian(double logit_max) {
    parameters p;
    for (int k = 0; k < 3; ++k) p[k] = uniform(-1, 1), p[3 + k] = uniform(-3, 0);
    p[2] += 4;
    for (int k = 0; k < 4; ++k) p[6 + k] = uniform(-2, 2);
    p[10] = uniform(-2, logit_max);
    for (double& v : p) v = static_cast<float>(v);
    return p;
  }
  // From near the origin to somewhere about the Gaussian.
  Eigen::Vector3d towards(parameters const& p, Eigen::Vector3d const& origin) {
    double const size = std::exp(std::max({p[3], p[4], p[5]}));
    Eigen::Vector3d const target = Eigen::Vector3d(p[0], p[1], p[2]) + size * uniform(0, 2) * direction();
    return (target - origin).normalized().cast<float>().cast<double>();
  }

 private:
  std::mt19937_64 random_;
};

gart::vec3 to_vec3(Eigen::Vector3d const& v) { return gart::vec3(v[0], v[1], v[2]); }

}  // namespace

TEST_CASE("t, response and alpha against double") {
  CAPTURE(gart_test::seed());
  source from(gart_test::seed());
  double worst_t = 0, worst_d2 = 0, worst_alpha = 0, worst_primary = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    parameters const p = from.gaussian(6);
    Eigen::Vector3d const origin = (0.5 * from.direction()).cast<float>().cast<double>();
    Eigen::Vector3d const direction = from.towards(p, origin);
    exact_response const e = exactly(p, origin, direction);
    gart::ray_gaussian const g = gart::prepare(stored(p), gart::vec3d(0.0), 1.0f / 255);
    gart::ray const r{to_vec3(origin), to_vec3(direction)};
    gart::ray_peak const got = gart::evaluate(g, r);
    // t is a quotient of sums in which the thinnest axis weighs most: rounding grows with the aspect ratio.
    double const aspect = std::exp(std::max({p[3], p[4], p[5]}) - std::min({p[3], p[4], p[5]}));
    worst_t = std::max(worst_t, std::fabs(got.t - e.t) / aspect);
    worst_d2 = std::max(worst_d2, std::fabs(got.d2 - e.d2) / (1 + e.d2));
    if (e.d2 < 12) worst_alpha = std::max(worst_alpha, std::fabs(gart::hit_alpha(g, got.d2) - std::min(0.99, e.alpha)));
    // The same ray from the frame's own origin.
    gart::ray_gaussian const local = gart::prepare(stored(p), gart::vec3d(r.origin), 1.0f / 255);
    gart::ray_peak const primary = gart::evaluate(local, gart::primary_ray{r.direction});
    worst_primary = std::max(worst_primary, std::fabs(primary.d2 - e.d2) / (1 + e.d2));
  }
  CAPTURE(worst_t);
  CAPTURE(worst_d2);
  CAPTURE(worst_alpha);
  CAPTURE(worst_primary);
  CHECK(worst_t < 2e-5);
  CHECK(worst_d2 < 1e-4);
  CHECK(worst_alpha < 5e-5);
  CHECK(worst_primary < 1e-4);
}

TEST_CASE("what is a hit") {
  gart::gaussian_parameters g{{0, 0, 2}, {0, 0, 0}, {1, 0, 0, 0}, 0};
  auto const cutoff_of = [](gart::gaussian_parameters const& p) { return gart::hit_cutoff(p, 1.0f / 255); };
  CHECK(cutoff_of(g) == doctest::Approx(2 * std::log(0.5 * 255)));
  gart::ray_gaussian const record = gart::prepare(g, gart::vec3d(0.0), 1.0f / 255);
  gart::ray_peak const ahead = gart::evaluate(record, gart::primary_ray{{0, 0, 1}});
  CHECK(gart::is_hit(record, ahead, 1.9f));
  CHECK_FALSE(gart::is_hit(record, ahead, 2.0f));
  CHECK_FALSE(gart::is_hit(record, gart::evaluate(record, gart::primary_ray{{0, 0, -1}}), 0.01f));
  CHECK(gart::hit_alpha(record, ahead.d2) == doctest::Approx(0.5));

  auto const never = [&](gart::gaussian_parameters const& p) {
    gart::ray_gaussian const r = gart::prepare(p, gart::vec3d(0.0), 1.0f / 255);
    CHECK(r.cutoff < 0);
    CHECK_FALSE(gart::is_hit(r, gart::evaluate(r, gart::primary_ray{{0, 0, 1}}), 0.0f));
    CHECK(gart::ellipsoid_box(p, gart::vec3d(0.0), 1.0f / 255).lo.x > 1e38f);
  };
  auto p = g;
  p.opacity = -5.6f;
  never(p);
  for (float bad : {NAN, INFINITY, -INFINITY}) {
    p = g, p.mean.y = bad, never(p);
    p = g, p.log_scale.z = bad, never(p);
    p = g, p.rotation.x = bad, never(p);
    p = g, p.opacity = bad, never(p);
  }
  p = g, p.rotation = {0, 0, 0, 0}, never(p);
  p = g, p.rotation = {1e-5f, 0, 0, 0}, never(p);
  p = g, p.log_scale.x = 41, never(p);
  p = g, p.opacity = 50;
  gart::ray_gaussian const solid = gart::prepare(p, gart::vec3d(0.0), 1.0f / 255);
  CHECK(gart::hit_alpha(solid, gart::evaluate(solid, gart::primary_ray{{0, 0, 1}}).d2) == gart::alpha_max);
}

TEST_CASE("scenes far from the origin lose nothing to the frame") {
  gart::vec3d const frame(4194304.0 + 0.3, -8388608.0 + 0.7, 1e6 + 0.1);
  gart::gaussian_parameters const g{{4194305.0f, -8388607.0f, 1000002.0f}, {-2, -1, -3}, {1, 2, 3, 4}, 1};
  gart::vec3 const m = gart::relative_mean(g.mean, frame);
  CHECK(m.x == doctest::Approx(0.7).epsilon(1e-6));
  CHECK(m.y == doctest::Approx(0.3).epsilon(1e-6));
  CHECK(m.z == doctest::Approx(1.9).epsilon(1e-6));
}

TEST_CASE_TEMPLATE("moments become the gradients of a weighted sum of alphas", Response, gart::generalized_gaussian<1>,
                   gart::generalized_gaussian<2>, gart::generalized_gaussian<3>, gart::generalized_gaussian<4>,
                   gart::generalized_gaussian<5>, gart::generalized_gaussian<8>) {
  CAPTURE(gart_test::seed());
  CAPTURE(Response::degree);
  source from(gart_test::seed() + 1);
  constexpr int rays = 12;
  struct group {
    char const* name;
    int first, count;
  };
  for (group const part : {group{"mean", 0, 3}, {"log-scale", 3, 3}, {"quaternion", 6, 4}, {"opacity", 10, 1}}) {
    double difference = 0, size = 0;
    for (int trial = 0; trial < 200; ++trial) {
      parameters const p = from.gaussian(2.0);  // below the clamp at 0.99
      std::vector<Eigen::Vector3d> directions;
      std::vector<double> weights;
      for (int k = 0; k < rays; ++k) {
        // A difference across the cusp of degree 1 is no derivative.
        do directions.resize(k), directions.push_back(from.towards(p, Eigen::Vector3d::Zero()));
        while (Response::degree == 1 && exactly(p, Eigen::Vector3d::Zero(), directions[k]).d2 < 0.01);
        weights.push_back(static_cast<float>(from.uniform(-1, 1)));
      }
      auto const loss = [&](parameters const& at) {
        double sum = 0;
        for (int k = 0; k < rays; ++k)
          sum += weights[k] * exactly(at, Eigen::Vector3d::Zero(), directions[k], Response::degree).alpha;
        return sum;
      };
      gart::gaussian_parameters const s = stored(p);
      gart::ray_gaussian const g = gart::prepare<Response>(s, gart::vec3d(0.0), 1e-6f);
      gart::moments_of<float> total{};
      for (int k = 0; k < rays; ++k) {
        gart::ray_peak const r = gart::evaluate(g, gart::primary_ray{to_vec3(directions[k])});
        gart::moments_of<float> const one = gart::hit_moments<Response>(g, r, static_cast<float>(weights[k]));
        for (int i = 0; i < gart::moment_count; ++i) total.v[i] += one.v[i];
      }
      gart::geometry_gradient const got = gart::from_moments(total.v, s, g);
      double const all[11] = {got.mean.x,      got.mean.y,      got.mean.z,     got.log_scale.x,
                              got.log_scale.y, got.log_scale.z, got.rotation.w, got.rotation.x,
                              got.rotation.y,  got.rotation.z,  got.opacity};
      for (int k = part.first; k < part.first + part.count; ++k) {
        double const h = 1e-5;
        parameters up = p, down = p;
        up[k] += h, down[k] -= h;
        double const expected = (loss(up) - loss(down)) / (2 * h);
        difference += (all[k] - expected) * (all[k] - expected), size += expected * expected;
      }
    }
    INFO(std::string(part.name));
    CHECK(std::sqrt(difference / size) < 1e-4);
  }
}

TEST_CASE("degree 1's cusp: gradients of one size, none in the middle") {
  using cusp = gart::generalized_gaussian<1>;
  gart::gaussian_parameters const g{{0, 0, 2}, {0, 0, 0}, {1, 0, 0, 0}, 0};
  gart::ray_gaussian const record = gart::prepare<cusp>(g, gart::vec3d(0.0), 1.0f / 255);
  auto const gradient_from = [&](float x, float y) {
    gart::ray const r{{x, y, 0}, {0, 0, 1}};
    gart::moments_of<float> const m = gart::hit_moments<cusp>(record, gart::evaluate(record, r), 1.0f);
    return gart::from_moments(m.v, g, record);
  };
  gart::geometry_gradient const centre = gradient_from(0, 0);
  CHECK(centre.mean == gart::vec3(0.0f));
  CHECK(centre.log_scale == gart::vec3(0.0f));
  CHECK(centre.opacity == doctest::Approx(0.25));
  for (float const r : {1e-6f, 1e-12f, 1e-19f}) {
    CAPTURE(r);
    CHECK(gradient_from(r, 0).mean.x == doctest::Approx(0.5 * 1.5).epsilon(1e-4));
    CHECK(gradient_from(-r, 0).mean.x == doctest::Approx(-0.5 * 1.5).epsilon(1e-4));
    CHECK(gradient_from(0, r).mean.y == doctest::Approx(0.5 * 1.5).epsilon(1e-4));
  }
  // Where the square of the offset is no longer a number, it is the centre.
  CHECK(gradient_from(1e-30f, 0).mean == gart::vec3(0.0f));
}

TEST_CASE("no gradient passes a clamp") {
  gart::gaussian_parameters const g{{0, 0, 2}, {0, 0, 0}, {1, 0, 0, 0}, 8};
  gart::ray_gaussian const record = gart::prepare(g, gart::vec3d(0.0), 1.0f / 255);
  gart::moments_of<float> const m =
      gart::hit_moments(record, gart::evaluate(record, gart::primary_ray{{0, 0, 1}}), 1.0f);
  for (float v : m.v) CHECK(v == 0.0f);
  gart::vec3 const c = gart::color_gradient_of({-0.1f, 0.0f, 0.2f}, {1, 1, 1}, 0.5f);
  CHECK(c == gart::vec3(0.0f, 0.0f, 0.5f));
}

TEST_CASE("the walk along a ray gives its colour's slope by each alpha") {
  double const alphas[] = {0.3, 0.8, 0.99, 0.1}, grey[] = {0.2, 0.9, 0.5, 0.7}, background = 0.4, weight = 1.7;
  auto const color = [&](double const* a) {
    double sum = 0, t = 1;
    for (int k = 0; k < 4; ++k) sum += t * a[k] * grey[k], t *= 1 - a[k];
    return sum + t * background;
  };
  gart::ray_gradient walk;
  walk.g = gart::vec3(static_cast<float>(weight), 0, 0);
  walk.color_g = static_cast<float>(weight * color(alphas));
  for (int k = 0; k < 4; ++k) {
    double up[4], down[4];
    std::copy_n(alphas, 4, up), std::copy_n(alphas, 4, down);
    up[k] += 1e-6, down[k] -= 1e-6;
    float part;
    float const got = walk.pass(static_cast<float>(alphas[k]), gart::vec3(static_cast<float>(grey[k]), 0, 0), part);
    CHECK(got == doctest::Approx(weight * (color(up) - color(down)) / 2e-6).epsilon(2e-4));
  }
}
