// Lanes of floats against floats: the formulas of math/ give each lane the bits they give a float alone.
#include <gart/math/hit_gradient.hpp>
#include <gart/math/lanes.hpp>
#include <gart/math/sh.hpp>
#include <support/policies.hpp>

namespace {

bool same(float a, float b) { return gart::float_to_bits(a) == gart::float_to_bits(b) || (a != a && b != b); }

template <class Response>
void compare(std::mt19937_64& random) {
  std::normal_distribution<float> n;
  for (int trial = 0; trial < 500; ++trial) {
    gart::ray_gaussian const g = gart::prepare<Response>({{n(random), n(random), 4 + n(random)},
                                                          {n(random) - 1, n(random) - 1, n(random) - 1},
                                                          {n(random), n(random), n(random), n(random)},
                                                          2 * n(random)},
                                                         gart::vec3d(0.0), 1.0f / 255);
    gart::vec3_of<gart::lanes> d;
    gart::lanes gradient;
    for (int l = 0; l < gart::lane_count; ++l) {
      gart::vec3 one(0.2f * n(random), 0.2f * n(random), 1.0f);
      one /= std::sqrt(one.x * one.x + one.y * one.y + one.z * one.z);
      d.x.v[l] = one.x, d.y.v[l] = one.y, d.z.v[l] = one.z, gradient.v[l] = n(random);
    }
    auto const r = gart::evaluate<Response>(g, gart::primary_ray_of<gart::lanes>{d});
    auto const hit = gart::is_hit(g, r, 0.01f);
    auto const alpha = gart::hit_alpha<Response>(g, r.d2);
    auto const m = gart::hit_moments<Response>(g, r, gradient);
    gart::sh_basis<3, gart::lanes> const basis(d);
    for (int l = 0; l < gart::lane_count; ++l) {
      gart::vec3 const one(d.x.v[l], d.y.v[l], d.z.v[l]);
      gart::response const expected = gart::evaluate<Response>(g, gart::primary_ray{one});
      CHECK(same(r.t.v[l], expected.t));
      CHECK(same(r.d2.v[l], expected.d2));
      CHECK((hit[l] != 0) == gart::is_hit(g, expected, 0.01f));
      CHECK(((gart::bits_of(hit) >> l & 1) != 0) == (hit[l] != 0));
      CHECK(same(alpha.v[l], gart::hit_alpha<Response>(g, expected.d2)));
      gart::moments const expected_moments = gart::hit_moments<Response>(g, expected, float(gradient.v[l]));
      for (int i = 0; i < gart::moment_count; ++i) CHECK(same(m.v[i].v[l], expected_moments.v[i]));
      gart::sh_basis<3> const expected_basis(one);
      for (int k = 0; k < 16; ++k) CHECK(same(basis.y[k].v[l], expected_basis.y[k]));
    }
  }
}

}  // namespace

TEST_CASE("a lane has the bits of a float") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  compare<gart::generalized_gaussian<2>>(random);
  compare<gart::generalized_gaussian<1>>(random);
  compare<gart::generalized_gaussian<5>>(random);
  compare<gart::generalized_gaussian<2, gart::arithmetic::fast>>(random);
}

TEST_CASE("lanes: select, reads, sums and the sign of zero") {
  gart::lanes a;
  float from[64];
  gart::lane_ints index;
  float sum = 0;
  for (int i = 0; i < 64; ++i) from[i] = 0.5f * static_cast<float>(i);
  for (int l = 0; l < gart::lane_count; ++l)
    a.v[l] = static_cast<float>(l - 2), index[l] = 63 - 3 * l, sum += static_cast<float>(l - 2);
  gart::lanes const chosen = gart::select(a < gart::lanes(0.0f), gart::lanes(7.0f), a), read = gart::read(from, index);
  for (int l = 0; l < gart::lane_count; ++l) {
    CHECK(chosen.v[l] == (l < 2 ? 7.0f : static_cast<float>(l - 2)));
    CHECK(read.v[l] == from[63 - 3 * l]);
  }
  CHECK(gart::sum_of(a) == sum);
  CHECK(std::signbit(float(gart::lanes(-0.0f).v[0])));
  CHECK(gart::any(a == gart::lanes(0.0f)));
  CHECK_FALSE(gart::any(a > gart::lanes(1000.0f)));
}
