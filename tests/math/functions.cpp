// Functions of one argument, rotations, spherical harmonics and the lens, each against double or its definition.
#include <gart/camera/models.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/math/sh.hpp>
#include <support/policies.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace {

using std::numbers::pi;

// Distance of a float from the exact value, in units of the exact value's last place.
double ulps(float got, double exact) {
  double const unit = std::ldexp(1.0, std::max(std::ilogb(exact), -126) - 23);
  return std::fabs(got - exact) / unit;
}

// Y_l^m, real, with the Condon-Shortley phase, by the recurrences of the associated Legendre functions.
double real_harmonic(int l, int m, double theta, double phi) {
  int const a = std::abs(m);
  double const x = std::cos(theta), s = std::sin(theta);
  double pmm = 1;
  for (int i = 1; i <= a; ++i) pmm *= -(2 * i - 1) * s;
  double p = pmm, before = 0;
  for (int k = a + 1; k <= l; ++k) {
    double const next = (x * (2 * k - 1) * p - (k + a - 1) * before) / (k - a);
    before = p, p = next;
  }
  double ratio = 1;
  for (int i = l - a + 1; i <= l + a; ++i) ratio *= i;
  double const norm = std::sqrt((2 * l + 1) / (4 * pi * ratio));
  if (m == 0) return norm * p;
  return std::sqrt(2.0) * norm * p * (m > 0 ? std::cos(a * phi) : std::sin(a * phi));
}

Eigen::Matrix3d rotation_of(Eigen::Vector4d const& wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
}

class numbers_source {
 public:
  explicit numbers_source(std::uint64_t seed) : random_(seed) {}
  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  gart::quaternion quaternion(double norm) {
    std::normal_distribution<double> n;
    Eigen::Vector4d q(n(random_), n(random_), n(random_), n(random_));
    q *= norm / q.norm();
    return {static_cast<float>(q[0]), static_cast<float>(q[1]), static_cast<float>(q[2]), static_cast<float>(q[3])};
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace

TEST_CASE("exponential within 2 ulp") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed());
  double worst = 0;
  for (int i = 0; i < 2'000'000; ++i) {
    float const x = static_cast<float>(i % 2 ? source.uniform(-87, 88) : source.uniform(-1, 1));
    worst = std::max(worst, ulps(gart::exponential(x), std::exp(static_cast<double>(x))));
  }
  CAPTURE(worst);
  CHECK(worst < 2);
  CHECK(gart::exponential(0.0f) == 1.0f);
  CHECK(gart::exponential(-88.0f) == 0.0f);
  CHECK(gart::exponential(-1e30f) == 0.0f);
  CHECK(ulps(gart::exponential(-87.0f), std::exp(-87.0)) < 2);
  CHECK(ulps(gart::exponential(88.0f), std::exp(88.0)) < 2);
}

TEST_CASE("logarithm within 2 ulp, and absolutely near 1") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed() + 1);
  double worst = 0, worst_near_one = 0;
  for (int i = 0; i < 2'000'000; ++i) {
    float const x = static_cast<float>(i % 2 ? std::exp(source.uniform(-87, 88)) : source.uniform(0.3, 3));
    double const exact = std::log(static_cast<double>(x));
    if (std::fabs(exact) > 0.5)
      worst = std::max(worst, ulps(gart::logarithm(x), exact));
    else
      worst_near_one = std::max(worst_near_one, std::fabs(gart::logarithm(x) - exact));
  }
  CAPTURE(worst);
  CAPTURE(worst_near_one);
  CHECK(worst < 2);
  CHECK(worst_near_one < 6e-8);
  CHECK(gart::logarithm(1.0f) == 0.0f);
}

TEST_CASE("sigmoid, and what is finite") {
  for (float x = -79; x < 30; x += 0.0371f) {
    double const exact = 1 / (1 + std::exp(-static_cast<double>(x)));
    if (std::fabs(gart::sigmoid(x) - exact) > 4e-7 * exact) FAIL_CHECK("sigmoid(" << x << ") = " << gart::sigmoid(x));
  }
  CHECK(gart::sigmoid(0.0f) == 0.5f);
  CHECK(gart::sigmoid(1e30f) == 1.0f);
  CHECK(gart::sigmoid(-1e30f) < 1e-30f);
  CHECK(gart::sigmoid(-1e30f) >= 0.0f);
  CHECK(gart::is_finite(3.4e38f));
  CHECK_FALSE(gart::is_finite(INFINITY));
  CHECK_FALSE(gart::is_finite(-INFINITY));
  CHECK_FALSE(gart::is_finite(NAN));
}

TEST_CASE_TEMPLATE("responses, their cut-offs and slopes against double", Response, gart::generalized_gaussian<1>,
                   gart::generalized_gaussian<2>, gart::generalized_gaussian<3>, gart::generalized_gaussian<4>,
                   gart::generalized_gaussian<5>, gart::generalized_gaussian<8>) {
  constexpr int n = Response::degree;
  CAPTURE(n);
  double worst_response = 0, worst_slope = 0, worst_cutoff = 0;
  for (double r = 1e-3; r < 3.6; r *= 1.003) {
    auto const d2 = static_cast<float>(r * r);
    double const radius = std::sqrt(static_cast<double>(d2)), exponent = -4.5 * std::pow(radius / 3, n);
    // What is off is the exponent, by two roundings or so.
    worst_response =
        std::max(worst_response, std::fabs(Response::response(d2) / std::exp(exponent) - 1) / (1 - exponent));
    CHECK(Response::estimated_response(d2) == Response::response(d2));  // on a host
    worst_slope = std::max(worst_slope, std::fabs(Response::slope(d2) * radius * radius / (-n * exponent) - 1));
  }
  for (double ratio = 1; ratio < 1e12; ratio *= 1.01) {
    auto const given = static_cast<float>(ratio);
    double const exact = 9 * std::pow(std::log(static_cast<double>(given)) / 4.5, 2.0 / n);
    float const got = Response::cutoff(given);
    worst_cutoff = std::max(worst_cutoff, std::fabs(got - exact) / std::max(exact, 1e-12));
  }
  CAPTURE(worst_response);
  CAPTURE(worst_slope);
  CAPTURE(worst_cutoff);
  CHECK(worst_response < 3e-7);
  CHECK(worst_slope < 1e-6);
  CHECK(worst_cutoff < 4e-7);
  CHECK(Response::response(0.0f) == 1.0f);
  CHECK(Response::response(9.0f) == doctest::Approx(std::exp(-4.5)).epsilon(1e-6));
  CHECK(Response::response(1e30f) == 0.0f);
  CHECK(Response::cutoff(1.0f) == 0.0f);
}

TEST_CASE("quaternions of any norm against Eigen") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed() + 2);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    gart::quaternion const q = source.quaternion(std::exp(source.uniform(-9, 20)));
    Eigen::Matrix3d const expected = rotation_of({q.w, q.x, q.y, q.z});
    gart::mat3 const m = gart::to_matrix(q);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) worst = std::max(worst, std::fabs(m[c][r] - expected(r, c)));
  }
  CHECK(worst < 1e-6);
}

TEST_CASE("a rotation's gradient against differences when normalised") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed() + 3);
  for (int trial = 0; trial < 300; ++trial) {
    Eigen::Matrix3d weights;
    for (int k = 0; k < 9; ++k) weights(k) = source.uniform(-1, 1);
    gart::quaternion const q = source.quaternion(std::exp(source.uniform(-4, 4)));
    Eigen::Vector4d const v(q.w, q.x, q.y, q.z);
    auto const f = [&](Eigen::Vector4d const& at) { return weights.cwiseProduct(rotation_of(at)).sum(); };
    // d/dw of <weights, R exp([w]x)> at w = 0.
    gart::vec3 body;
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d const e = Eigen::Vector3d::Unit(k);
      Eigen::Matrix3d cross;
      cross << 0, -e[2], e[1], e[2], 0, -e[0], -e[1], e[0], 0;
      body[k] = static_cast<float>(weights.cwiseProduct(rotation_of(v) * cross).sum());
    }
    gart::quaternion const g = gart::pull_back(q, body);
    Eigen::Vector4d const got(g.w, g.x, g.y, g.z);
    Eigen::Vector4d expected;
    double const h = 1e-5 * v.norm();
    for (int k = 0; k < 4; ++k) {
      Eigen::Vector4d const step = h * Eigen::Vector4d::Unit(k);
      expected[k] = (f(v + step) - f(v - step)) / (2 * h);
    }
    CHECK((got - expected).norm() < 2e-6 / v.norm() + 1e-5 * expected.norm());
    CHECK(std::fabs(got.dot(v)) < 1e-5);
  }
}

TEST_CASE("real spherical harmonics with Condon-Shortley phase") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed() + 4);
  for (int trial = 0; trial < 200; ++trial) {
    double const theta = std::acos(source.uniform(-1, 1)), phi = source.uniform(0, 2 * pi);
    gart::vec3 const d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    gart::sh_basis<3> const basis(d);
    for (int l = 0, k = 0; l <= 3; ++l)
      for (int m = -l; m <= l; ++m, ++k)
        CHECK(basis.y[k] == doctest::Approx(real_harmonic(l, m, theta, phi)).epsilon(2e-6));
    gart::sh_basis<1> const low(d);
    for (int k = 0; k < 4; ++k) CHECK(low.y[k] == basis.y[k]);
  }
}

TEST_CASE("spherical harmonics are orthonormal") {
  // Exact for polynomials of degree 6: Gauss-Legendre of 4 points in z, 8 even angles around it.
  double const z[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
  double const w[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
  double gram[16][16] = {};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 8; ++j) {
      double const s = std::sqrt(1 - z[i] * z[i]), phi = (j + 0.3) * pi / 4;
      gart::sh_basis<3> const b(gart::vec3(s * std::cos(phi), s * std::sin(phi), z[i]));
      for (int k = 0; k < 16; ++k)
        for (int l = 0; l < 16; ++l) gram[k][l] += w[i] * pi / 4 * b.y[k] * b.y[l];
    }
  for (int k = 0; k < 16; ++k)
    for (int l = 0; l < 16; ++l) CHECK(std::fabs(gram[k][l] - (k == l)) < 1e-6);
}

namespace {

template <int Degree>
void check_active_degrees() {
  constexpr int n = 3 * (Degree + 1) * (Degree + 1);
  gart::sh_basis<Degree> const basis(gart::vec3(0.48f, -0.6f, 0.64f));
  alignas(16) float c[n];
  for (int k = 0; k < n; ++k) c[k] = 0.1f * static_cast<float>(k % 7) - 0.2f;
  for (int active = 0; active <= Degree; ++active) {
    CAPTURE(Degree);
    CAPTURE(active);
    gart::vec3 expected(0.5f);
    for (int k = 0; k < (active + 1) * (active + 1); ++k)
      for (int i = 0; i < 3; ++i) expected[i] += basis.y[k] * c[3 * k + i];
    gart::vec3 const got = basis.unclamped(gart::sh_row<Degree>(c, active).v);
    for (int i = 0; i < 3; ++i) CHECK(got[i] == doctest::Approx(expected[i]));
  }
}

}  // namespace

TEST_CASE("colour leaves out inactive bands and clamps at zero") {
  check_active_degrees<0>();
  check_active_degrees<1>();
  check_active_degrees<2>();
  check_active_degrees<3>();
  CHECK(gart::clamped_color({-0.5f, 0.25f, 3.0f}) == gart::vec3(0.0f, 0.25f, 3.0f));
}

TEST_CASE("undistort inverts the lens") {
  CAPTURE(gart_test::seed());
  numbers_source source(gart_test::seed() + 5);
  double worst = 0;
  for (int trial = 0; trial < 200; ++trial) {
    gart::distortion lens;
    lens.k1 = static_cast<float>(source.uniform(-0.15, 0.3)), lens.k2 = static_cast<float>(source.uniform(0, 0.1));
    lens.p1 = static_cast<float>(source.uniform(-0.01, 0.01));
    lens.p2 = static_cast<float>(source.uniform(-0.01, 0.01));
    for (int i = 0; i < 100; ++i) {
      double const x = source.uniform(-0.8, 0.8), y = source.uniform(-0.8, 0.8), r2 = x * x + y * y;
      double const radial = 1 + lens.k1 * r2 + lens.k2 * r2 * r2;
      double const u = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x);
      double const v = y * radial + 2 * lens.p2 * x * y + lens.p1 * (r2 + 2 * y * y);
      gart::vec2 const p = gart::undistort(lens, {static_cast<float>(u), static_cast<float>(v)});
      worst = std::max({worst, std::fabs(p.x - x), std::fabs(p.y - y)});
    }
  }
  CAPTURE(worst);
  CHECK(worst < 1e-6);
}

TEST_CASE("the ray of a pixel goes through the pixel") {
  gart::camera c;
  c.width = 64, c.height = 48, c.fx = 50, c.fy = 60, c.cx = 30, c.cy = 25;
  c.rotation = gart::to_matrix({0.3f, -0.7f, 0.2f, 0.4f});
  gart::vec3 const d = gart::ray_direction(c, 10.5f, 40.5f);
  auto const along = [&](int k) { return d.x * c.rotation[k].x + d.y * c.rotation[k].y + d.z * c.rotation[k].z; };
  CHECK(d.x * d.x + d.y * d.y + d.z * d.z == doctest::Approx(1));
  CHECK(50 * along(0) / along(2) + 30 == doctest::Approx(10.5));
  CHECK(60 * along(1) / along(2) + 25 == doctest::Approx(40.5));
}
