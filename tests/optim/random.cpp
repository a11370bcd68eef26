#include <support/policies.hpp>

#include <gart/optim/random.hpp>
#include <gart/optim/schedule.hpp>

#include <vector>

using namespace gart;

TEST_CASE("Philox4x32-10 gives the published known answers") {
  auto const check = [](random_words counter, u32 key0, u32 key1, random_words expected) {
    random_words const got = philox4x32(counter, key0, key1);
    for (int i = 0; i < 4; ++i) CHECK(got.v[i] == expected.v[i]);
  };
  check({{0, 0, 0, 0}}, 0, 0, {{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}});
  check({{~0u, ~0u, ~0u, ~0u}}, ~0u, ~0u, {{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}});
  check({{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}}, 0xa4093822, 0x299f31d0,
        {{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}});
}

TEST_CASE("draws differ with every part of what names them") {
  random_source const base{1, 2, random_use::noise};
  auto const first = [](random_source const& s, u64 index) { return s.words(index).v[0]; };
  u32 const drawn = first(base, 3);
  CHECK(drawn == first({1, 2, random_use::noise}, 3));
  CHECK(drawn != first({u64{1} << 32 | 1, 2, random_use::noise}, 3));
  CHECK(drawn != first({1, 3, random_use::noise}, 3));
  CHECK(drawn != first({1, 2, random_use::split}, 3));
  CHECK(drawn != first(base, u64{1} << 32 | 3));
}

TEST_CASE("below is the high half of the product") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (int i = 0; i < 10000; ++i) {
    u64 const word = random(), bound = random() >> (random() % 64);
    u64 const expected = static_cast<u64>((static_cast<unsigned __int128>(word) * bound) >> 64);
    REQUIRE(below(static_cast<u32>(word >> 32), static_cast<u32>(word), bound) == expected);
  }
}

TEST_CASE("uniforms and normals have their moments") {
  random_source const source{7, 0, random_use::user};
  double sum = 0, square = 0, normal_sum = 0, normal_square = 0, fourth = 0;
  int const n = 200000;
  for (int i = 0; i < n; ++i) {
    random_words const w = source.words(i);
    float const u = uniform(w.v[3]);
    REQUIRE((u >= 0 && u < 1));
    sum += u, square += u * u;
    random_normals const z = normals(w);
    for (float const v : z.v) {
      REQUIRE(std::isfinite(v));
      normal_sum += v, normal_square += v * v, fourth += static_cast<double>(v) * v * v * v;
    }
  }
  CHECK(sum / n == doctest::Approx(0.5).epsilon(0.01));
  CHECK(square / n == doctest::Approx(1.0 / 3).epsilon(0.01));
  CHECK(std::abs(normal_sum / (4 * n)) < 0.006);
  CHECK(normal_square / (4 * n) == doctest::Approx(1).epsilon(0.01));
  CHECK(fourth / (4 * n) == doctest::Approx(3).epsilon(0.03));
  CHECK(std::isfinite(normals({{0, 0, ~0u, ~0u}}).v[0]));
}

TEST_CASE("the rate of the means decays exponentially") {
  CHECK(exponential_decay(1e-2f, 1e-4f, 0, 100) == 1e-2f);
  CHECK(exponential_decay(1e-2f, 1e-4f, 50, 100) == doctest::Approx(1e-3));
  CHECK(exponential_decay(1e-2f, 1e-4f, 100, 100) == doctest::Approx(1e-4));
  CHECK(exponential_decay(1e-2f, 1e-4f, 1000, 100) == doctest::Approx(1e-4));
  CHECK(exponential_decay(1e-2f, 0, 25, 100) == doctest::Approx(0.75e-2));
  CHECK(exponential_decay(1e-2f, 0, 100, 100) == 0.0f);
  CHECK(exponential_decay(0, 1e-2f, 50, 100) == 0.0f);
  learning_rates usual;
  CHECK(rates_at(usual, 3.0f, 0, 20000).mean == doctest::Approx(3 * usual.mean));
  CHECK(rates_at(usual, 3.0f, 20000, 20000).mean == doctest::Approx(3 * usual.mean_final));
  CHECK(rates_at(usual, 3.0f, 10000, 20000).opacity == usual.opacity);
  CHECK(rates_at(usual, 3.0f, 15000, 20000).opacity == doctest::Approx(usual.opacity * std::sqrt(0.1)));
  CHECK(rates_at(usual, 3.0f, 20000, 20000).sh_rest == doctest::Approx(0.1 * usual.sh_rest));
  // A quarter of a long run: twice as fast, and settling from 0.5 + 3/4 (0.9 - 0.5) = 0.8 of it on.
  int const quarter = usual.long_run / 4;
  CHECK(rates_at(usual, 3.0f, 0, quarter).mean == doctest::Approx(6 * usual.mean));
  CHECK(rates_at(usual, 3.0f, 0, quarter).sh_dc == usual.sh_dc);
  CHECK(rates_at(usual, 3.0f, quarter * 79 / 100, quarter).log_scale == 2 * usual.log_scale);
  CHECK(rates_at(usual, 3.0f, quarter * 9 / 10, quarter).log_scale ==
        doctest::Approx(2 * usual.log_scale * std::sqrt(0.1)).epsilon(1e-2));
  CHECK(rates_at(usual, 3.0f, quarter, quarter).log_scale == doctest::Approx(0.2 * usual.log_scale));
  usual.decay_start_short = 0;  // never before decay_start
  CHECK(rates_at(usual, 3.0f, quarter / 2, quarter).sh_dc == usual.sh_dc);
  CHECK(rates_at(usual, 3.0f, 0, quarter).sh_rest == usual.sh_rest);
  CHECK(rates_at(usual, 3.0f, 0, 10).opacity == doctest::Approx(4 * usual.opacity));
}

TEST_CASE("the SH degree rises in steps, sooner in short runs") {
  CHECK(sh_degree_at(999, 3, 1000, 30000) == 0);
  CHECK(sh_degree_at(1000, 3, 1000, 30000) == 1);
  CHECK(sh_degree_at(29999, 3, 1000, 30000) == 3);
  CHECK(sh_degree_at(29, 3, 1000, 900) == 0);
  CHECK(sh_degree_at(30, 3, 1000, 900) == 1);
  CHECK(sh_degree_at(90, 3, 1000, 900) == 3);
  CHECK(sh_degree_at(0, 3, 1000, 1) == 0);
  CHECK(sh_degree_at(500, 0, 1000, 900) == 0);
}
