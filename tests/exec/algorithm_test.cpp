// Scan, sort and reductions against std:: on random arrays of awkward sizes.
#include "support/policies.hpp"

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/reduce.hpp>
#include <gart/algorithm/segmented_reduce.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/exec/buffer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using namespace gart;

namespace {

std::size_t const sizes[] = {0, 1, 2, 31, 255, 257, 4096, 16385, 65537, 1000003};

template <class T>
std::vector<T> random_values(std::mt19937_64& random, std::size_t n, u64 below) {
  std::vector<T> v(n);
  for (auto& x : v) x = static_cast<T>(below ? random() % below : random());
  return v;
}

template <class T, class E>
void check_scan(E& exec, std::vector<u32> const& host) {
  std::size_t const n = host.size();
  CAPTURE(n);
  buffer<u32, E> in(exec, host);
  buffer<T, E> out(exec, n + 1);
  exclusive_scan(exec, in, out.view().subspan(0, n), out.view().subspan(n, 1));
  std::vector<T> expected(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) expected[i + 1] = expected[i] + host[i];
  CHECK(out.to_host() == expected);
  CHECK(in.to_host() == host);

  buffer<T, E> without(exec, n);
  exclusive_scan(exec, in, without.view());
  expected.pop_back();
  CHECK(without.to_host() == expected);
}

template <class K, class E>
void check_sort(E& exec, std::vector<K> const& host, int key_bits) {
  std::size_t const n = host.size();
  CAPTURE(n);
  CAPTURE(key_bits);
  std::vector<u32> order(n);
  std::iota(order.begin(), order.end(), 0u);
  buffer<K, E> keys(exec, host), whole_keys(exec, host);
  buffer<u32, E> values(exec, order), whole_values(exec, order);
  sort_pairs(exec, keys.view(), values.view(), key_bits);
  sort_pairs(exec, whole_keys, whole_values, key_bits);

  K const mask = key_bits == 0 ? K{0} : static_cast<K>(~K{0}) >> (8 * sizeof(K) - key_bits);
  std::stable_sort(order.begin(), order.end(), [&](u32 a, u32 b) { return (host[a] & mask) < (host[b] & mask); });
  CHECK(values.to_host() == order);
  std::vector<K> sorted(n);
  for (std::size_t i = 0; i < n; ++i) sorted[i] = host[order[i]];
  CHECK(keys.to_host() == sorted);
  CHECK(whole_keys.to_host() == sorted);
  CHECK(whole_values.to_host() == order);
}

template <class T, class E>
T reduced(E& exec, std::vector<T> const& host, reduction op) {
  buffer<T, E> in(exec, host), out(exec, 1);
  reduce(exec, in, out.view(), op);
  return out.front();
}

template <class T, class E>
void check_reduce(E& exec, std::vector<T> const& host) {
  CAPTURE(host.size());
  long double sum = 0, magnitude = 0;
  T lowest = std::numeric_limits<T>::has_infinity ? std::numeric_limits<T>::infinity() : std::numeric_limits<T>::max();
  T largest = std::numeric_limits<T>::has_infinity ? -lowest : std::numeric_limits<T>::lowest();
  T wrapped = 0;
  for (T const x : host) {
    sum += x;
    magnitude += std::abs(static_cast<long double>(x));
    wrapped = static_cast<T>(wrapped + x);
    lowest = std::min(lowest, x);
    largest = std::max(largest, x);
  }
  T const got = reduced(exec, host, reduction::sum);
  if constexpr (std::is_floating_point_v<T>)
    // Floats are added in double: all but the last rounding is far below theirs.
    CHECK(std::abs(got - sum) <=
          std::numeric_limits<T>::epsilon() * (std::abs(sum) + (sizeof(T) == 4 ? 1e-6L : 1.0L) * magnitude));
  else
    CHECK(got == wrapped);
  CHECK(got == reduced(exec, host, reduction::sum));
  CHECK(reduced(exec, host, reduction::min) == lowest);
  CHECK(reduced(exec, host, reduction::max) == largest);
}

// The order of additions that the header promises, written down once more.
float sum_in_turn(std::vector<float> const& rows, u32 columns, u32 column, u64 begin, u64 end) {
  float s[4] = {0, 0, 0, 0};
  for (u64 r = begin; r < end; ++r) s[(r - begin) % 4] += rows[r * columns + column];
  return (s[0] + s[1]) + (s[2] + s[3]);
}

template <class O, class E>
void check_segments(E& exec, std::mt19937_64& random, u32 columns, std::size_t segments) {
  CAPTURE(columns);
  CAPTURE(segments);
  std::vector<O> offsets(segments + 1, 0);
  for (std::size_t s = 0; s < segments; ++s)
    offsets[s + 1] = offsets[s] + static_cast<O>(random() % 4 ? random() % 9 : 0);
  offsets[segments] += 1000;  // one long segment
  std::vector<float> rows(static_cast<std::size_t>(offsets[segments]) * columns);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (auto& x : rows) x = uniform(random);

  buffer<float, E> in(exec, rows), out(exec, std::vector<float>(segments * columns, 99.0f));
  buffer<O, E> bounds(exec, offsets);
  segmented_reduce(exec, in, columns, bounds, out);
  auto const got = out.to_host();
  std::size_t wrong = 0;
  double worst = 0;
  for (std::size_t s = 0; s < segments; ++s)
    for (u32 c = 0; c < columns; ++c) {
      double sum = 0;
      for (O r = offsets[s]; r < offsets[s + 1]; ++r) sum += rows[r * columns + c];
      float const value = got[s * columns + c];
      worst = std::max(worst, std::abs(value - sum));
      wrong += value != sum_in_turn(rows, columns, c, offsets[s], offsets[s + 1]);
    }
  CHECK(wrong == 0);
  CHECK(worst < 1e-4);
}

}  // namespace

TEST_CASE_TEMPLATE("exclusive_scan agrees with a loop", E, GART_TEST_POLICIES) {
  u64 const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  for (std::size_t n : sizes) {
    check_scan<u32>(exec, random_values<u32>(random, n, 100));
    check_scan<u64>(exec, random_values<u32>(random, n, 0));
    check_scan<u32>(exec, random_values<u32>(random, n, 0));  // wraps
  }
}

TEST_CASE_TEMPLATE("sort_pairs is stable and reads the low bits only", E, GART_TEST_POLICIES) {
  u64 const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  for (std::size_t n : sizes) {
    check_sort(exec, random_values<u32>(random, n, 0), 32);
    check_sort(exec, random_values<u32>(random, n, 0), static_cast<int>(random() % 33));
    check_sort(exec, random_values<u32>(random, n, 5), 32);  // many equal keys
    check_sort(exec, random_values<u32>(random, n, 0), 13);
    check_sort(exec, random_values<u64>(random, n, 0), 64);
    check_sort(exec, random_values<u64>(random, n, 0), static_cast<int>(random() % 65));
    check_sort(exec, random_values<u64>(random, n, 3), 63);
    check_sort(exec, std::vector<u64>(n, u64{42} << 40), 64);
  }
}

TEST_CASE_TEMPLATE("sorting again allocates nothing", E, GART_TEST_POLICIES) {
  E exec;
  std::mt19937_64 random(1);
  check_sort(exec, random_values<u64>(random, 50000, 0), 48);
  auto const peak = exec.memory.peak, current = exec.memory.current;
  check_sort(exec, random_values<u64>(random, 50000, 0), 48);
  check_sort(exec, random_values<u32>(random, 40000, 0), 32);
  CHECK(exec.memory.peak == peak);
  CHECK(exec.memory.current == current);
}

TEST_CASE_TEMPLATE("reduce sums, and finds the least and the largest", E, GART_TEST_POLICIES) {
  u64 const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  E exec;
  for (std::size_t n : sizes) {
    std::vector<float> f(n);
    std::vector<double> d(n);
    for (auto& x : f) x = static_cast<float>(normal(random));
    for (auto& x : d) x = normal(random);
    check_reduce(exec, f);
    check_reduce(exec, d);
    check_reduce(exec, random_values<u32>(random, n, 0));
    check_reduce(exec, random_values<u64>(random, n, 0));
  }
}

TEST_CASE_TEMPLATE("segmented_reduce adds the rows of each segment in one order", E, GART_TEST_POLICIES) {
  u64 const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  for (u32 columns : {1u, 3u, 59u})
    for (std::size_t segments : {1, 2, 100, 3001}) {
      check_segments<u32>(exec, random, columns, segments);
      check_segments<u64>(exec, random, columns, segments);
    }
  buffer<float, E> none(exec);
  segmented_reduce(exec, none, 59, buffer<u32, E>(exec), none);
  segmented_reduce(exec, none, 59, buffer<u32, E>(exec, std::vector<u32>{0}), none);
}

TEST_CASE_TEMPLATE("spans that are too short and bits out of range are refused", E, GART_TEST_POLICIES) {
  E exec;
  buffer<u32, E> two(exec, 2), one(exec, 1), none(exec);
  buffer<float, E> floats(exec, 4);
  CHECK_THROWS_AS(exclusive_scan(exec, two, one.view()), invalid_argument);
  CHECK_THROWS_AS(sort_pairs(exec, two.view(), one.view(), 32), invalid_argument);
  CHECK_THROWS_AS(sort_pairs(exec, two.view(), two.view(), 33), invalid_argument);
  CHECK_THROWS_AS(sort_pairs(exec, two.view(), two.view(), -1), invalid_argument);
  CHECK_THROWS_AS(reduce(exec, two, none.view()), invalid_argument);
  CHECK_THROWS_AS(segmented_reduce(exec, floats, 9, two, floats), invalid_argument);
}

#if !defined(GART_TEST_CUDA)
TEST_CASE("any number of threads gives the serial result") {
  u64 const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  std::vector<float> host(200000);
  for (auto& x : host) x = normal(random);
  serial_exec serial;
  float const expected = reduced(serial, host, reduction::sum);
  for (int threads : {1, 2, 3, 7}) {
    CAPTURE(threads);
    openmp_exec exec(threads);
    CHECK(reduced(exec, host, reduction::sum) == expected);
    check_sort(exec, random_values<u64>(random, 200000, 1000), 20);
    check_scan<u64>(exec, random_values<u32>(random, 200000, 0));
  }
}
#endif
