// Lanes of floats against floats: the formulas of math/ give each lane the bits they give a float alone.
#include <gart/math/hit_gradient.hpp>
#include <gart/math/lane_transpose.hpp>
#include <gart/math/lanes.hpp>
#include <gart/math/sh.hpp>
#include <gart/render/pixels.hpp>
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
    auto const r = gart::evaluate(g, gart::primary_ray_of<gart::lanes>{d});
    auto const hit = gart::is_hit(g, r, 0.01f);
    auto const alpha = gart::hit_alpha<Response>(g, r.d2);
    auto const m = gart::hit_moments<Response>(g, r, gradient);
    gart::sh_basis<3, gart::lanes> const basis(d);
    for (int l = 0; l < gart::lane_count; ++l) {
      gart::vec3 const one(d.x.v[l], d.y.v[l], d.z.v[l]);
      gart::ray_peak const expected = gart::evaluate(g, gart::primary_ray{one});
      CHECK(same(r.t.v[l], expected.t));
      CHECK(same(r.d2.v[l], expected.d2));
      CHECK(hit[l] == gart::is_hit(g, expected, 0.01f));
      CHECK(((gart::bits_of(hit) >> l & 1) != 0) == hit[l]);
      CHECK(same(alpha.v[l], gart::hit_alpha<Response>(g, expected.d2)));
      gart::moments_of<float> const expected_moments = gart::hit_moments<Response>(g, expected, float(gradient.v[l]));
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
}

TEST_CASE("lanes: select, masks, sums and the sign of zero") {
  gart::lanes a, many[10];
  float sum = 0;
  for (int l = 0; l < gart::lane_count; ++l) a.v[l] = static_cast<float>(l - 2), sum += static_cast<float>(l - 2);
  gart::lanes const chosen = gart::select(a < gart::lanes(0.0f), gart::lanes(7.0f), a);
  for (int l = 0; l < gart::lane_count; ++l) {
    CHECK(chosen.v[l] == (l < 2 ? 7.0f : static_cast<float>(l - 2)));
    CHECK((a <= gart::lanes(-1.0f))[l] == (l < 2));
    CHECK(gart::lanes_of(5u)[l] == (l == 0 || l == 2));
    CHECK(gart::negative(-gart::magnitude(a))[l]);
    CHECK(gart::equal(gart::every_lane(0x80000000u), gart::every_lane(1u))[l] == false);
    CHECK(gart::at_most(gart::every_lane(1u), gart::every_lane(0x80000000u))[l]);
  }
  float sums[16];
  for (int k = 0; k < 10; ++k) many[k] = static_cast<float>(k) * a;
  gart::sums_of(many, sums);
  for (int k = 0; k < 16; ++k) CHECK(sums[k] == (k < 10 ? static_cast<float>(k) * sum : 0.0f));
  CHECK(std::signbit(float(gart::lanes(-0.0f).v[0])));
  CHECK(gart::any(a == gart::lanes(0.0f)));
  CHECK_FALSE(gart::any(a > gart::lanes(1000.0f)));
}

TEST_CASE("lanes: numbers in turns and in fours") {
  gart::lanes from[4], to[4];
  for (int k = 0; k < 4; ++k)
    for (int l = 0; l < gart::lane_count; ++l) from[k].v[l] = static_cast<float>(100 * k + l + 1);
  for (int n : {3, 12, 24, 27, 48}) {
    if (n > 3 * gart::lane_count) continue;
    std::vector<float> turns(static_cast<std::size_t>(n) + 1, -1.0f);
    gart::write_interleaved(turns.data(), n, from[0], from[1], from[2]);
    for (int i = 0; i < n; ++i) CHECK(turns[static_cast<std::size_t>(i)] == from[i % 3].v[i / 3]);
    CHECK(turns.back() == -1.0f);
  }
  int const stride = 23;
  for (gart::u32 bits : {0u, 1u, 0xa6c5u, 0xffffu}) {
    gart::lane_mask const m = gart::lanes_of(bits & ((1u << gart::lane_count) - 1));
    std::vector<float> memory(4 * stride, -1.0f);
    gart::lane_words places;
    for (int l = 0; l < gart::lane_count; ++l) places[l] = static_cast<gart::u32>((7 * l + 3) % gart::lane_count);
    std::vector<float> scattered(4 * gart::lane_count, -1.0f);
    gart::scatter_fours(scattered.data(), places, m, from);
    for (int l = 0; l < gart::lane_count; ++l)
      for (int k = 0; k < 4; ++k) {
        memory[static_cast<std::size_t>(l / 4 * stride + l % 4 * 4 + k)] = m[l] ? from[k].v[l] : -1.0f;
        CHECK(scattered[4 * places[l] + static_cast<gart::u32>(k)] == (m[l] ? from[k].v[l] : -1.0f));
      }
    gart::read_fours(memory.data(), stride, m, to);
    for (int l = 0; l < gart::lane_count; ++l)
      for (int k = 0; k < 4; ++k) {
        CHECK(to[k].v[l] == (m[l] ? from[k].v[l] : 0.0f));
      }
  }
}

TEST_CASE("a packet's rays have the bits of single rays") {
  gart::camera view;
  view.width = 64, view.height = 48, view.fx = 40, view.fy = 41, view.cx = 31, view.cy = 25;
  gart::serial_exec exec;
  gart::camera_rays<gart::serial_exec> rays(exec);
  for (gart::distortion const& lens : {gart::distortion{}, gart::distortion{0.06f, -0.08f, -0.002f, 0.003f}}) {
    view.lens = lens;
    rays.cast(exec, view);
    for (int y = 0; y < view.height; y += gart::packet_block::height)
      for (int x = 0; x < view.width; x += gart::packet_block::width) {
        auto const d = gart::pixel_directions(rays.view(), {x, y});
        for (int l = 0; l < gart::lane_count; ++l) {
          gart::vec3 const one =
              gart::pixel_ray(view, {x + gart::packet_block::column(l), y + gart::packet_block::row(l)}).direction;
          for (int k = 0; k < 3; ++k) CHECK(same(d[k].v[l], one[k]));
        }
      }
  }
}
