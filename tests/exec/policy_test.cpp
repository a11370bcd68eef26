// Buffers, launches and the profiler of every policy.
#include "support/policies.hpp"

#include <gart/exec/buffer.hpp>
#include <gart/exec/early_copy.hpp>
#include <gart/exec/stage.hpp>

#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace gart;

namespace {

struct square {
  span<u32> out;
  GART_HD void operator()(index_t i) const { out[i] = i * i; }
};

struct small_blocks {
  static constexpr int block_size = 64;
  static constexpr int min_blocks = 2;
  span<u32> out;
  GART_HD void operator()(index_t i) const { out[i] = i + 1; }
};

template <class E, class T>
struct count_into {
  span<T> bins;
  GART_HD void operator()(index_t i) const { E::atomic_add(&bins[i % bins.size()], static_cast<T>(1)); }
};

// Twelve of a row's sixteen floats, as a kernel adds the gradients of one hit.
template <class E>
struct add_rows {
  span<float> rows;
  GART_HD void operator()(index_t i) const {
    float values[16] = {};
    for (int k = 0; k < 12; ++k) values[k] = static_cast<float>(k + 1);
    E::template atomic_add_row<16>(&rows[i % 5 * 16], values, 12);
  }
};

// Reverses a tile through scratch: wrong unless the barrier holds and every lane's part is done.
template <int Width>
struct reverse_tiles {
  struct scratch {
    u32 value[Width];
    u32 sum;
  };
  span<u32 const> in;
  span<u32> out;
  span<u32> sums;

  template <class Team>
  GART_HD void operator()(Team const& team) const {
    auto& s = team.scratch();
    index_t const begin = team.tile() * Width;
    team.for_each(Width, [&](index_t i) { s.value[i] = in[begin + i]; });
    team.barrier();
    team.for_each(Width, [&](index_t i) { out[begin + i] = s.value[Width - 1 - i]; });
    team.for_each(1, [&](index_t) {
      s.sum = 0;
      for (int k = 0; k < Width; ++k) s.sum += s.value[k];
    });
    team.barrier();
    team.for_each(1, [&](index_t) { sums[team.tile()] = s.sum; });
  }
};

std::vector<u32> numbers(std::size_t n) {
  std::vector<u32> v(n);
  std::iota(v.begin(), v.end(), 7u);
  return v;
}

template <int Width, class E>
void check_tiles(E& exec, index_t tiles, index_t lanes) {
  CAPTURE(Width);
  CAPTURE(tiles);
  CAPTURE(lanes);
  auto const host = numbers(std::size_t{tiles} * Width);
  buffer<u32, E> in(exec, host), out(exec, host.size()), sums(exec, tiles);
  out.zero();
  parallel_for(exec, "reverse", tile_range{tiles, lanes}, reverse_tiles<Width>{in, out, sums});
  auto const reversed = out.to_host(), sum = sums.to_host();
  std::size_t wrong = 0;
  for (index_t t = 0; t < tiles; ++t) {
    u32 expected = 0;
    for (int i = 0; i < Width; ++i) {
      wrong += reversed[t * Width + i] != host[t * Width + Width - 1 - i];
      expected += host[t * Width + i];
    }
    wrong += sum[t] != expected;
  }
  CHECK(wrong == 0);
}

template <class E, class T>
void check_atomics() {
  E exec;
  buffer<T, E> bins(exec, 7);
  bins.zero();
  parallel_for(exec, "count", 2800000, count_into<E, T>{bins});
  for (T const count : bins.to_host()) CHECK(count == static_cast<T>(400000));
}

}  // namespace

TEST_CASE_TEMPLATE("a policy satisfies its concept", E, GART_TEST_POLICIES) {
  static_assert(execution<E>);
  static_assert(host_execution<E> == !E::device);
  static_assert(index_kernel<square> && !tile_kernel<square>);
  static_assert(tile_kernel<reverse_tiles<8>> && !index_kernel<reverse_tiles<8>>);
}

TEST_CASE_TEMPLATE("a buffer carries data in, across and out", E, GART_TEST_POLICIES) {
  E exec;
  for (std::size_t n : {0, 1, 3, 1000, 3000001}) {
    CAPTURE(n);
    auto host = numbers(n);
    auto const expected = host;
    buffer<u32, E> a(exec, host);
    std::fill(host.begin(), host.end(), 0u);  // the source is free again on return
    buffer<u32, E> b(exec, n);
    exec.copy(b.data(), a.data(), n * sizeof(u32));
    CHECK(b.to_host() == expected);
    if (n) CHECK(b.front() == expected[0]);
    b.zero();
    CHECK(b.to_host() == std::vector<u32>(n, 0u));
    CHECK(a.to_host() == expected);
  }
}

TEST_CASE_TEMPLATE("many uploads in a row each arrive", E, GART_TEST_POLICIES) {
  E exec;
  std::vector<buffer<u32, E>> buffers;
  std::vector<u32> host(300000);
  for (u32 k = 0; k < 24; ++k) {
    std::fill(host.begin(), host.end(), k);
    buffers.emplace_back(exec, host);
  }
  for (u32 k = 0; k < 24; ++k) CHECK(buffers[k].to_host() == std::vector<u32>(host.size(), k));
}

TEST_CASE_TEMPLATE("an early copy is read after later work is queued", E, GART_TEST_POLICIES) {
  E exec;
  buffer<u32, E> later(exec, 1000);
  for (std::size_t n : {3, 100000, 0, 1, 200000}) {  // larger and smaller than the room of the last
    CAPTURE(n);
    auto const values = numbers(n);
    buffer<u32, E> from(exec, values);
    std::vector<u32> read(n + 1, 9u);
    early_copy<E> copy(exec, from.data(), n * sizeof(u32));
    parallel_for(exec, "later", 1000, square{later});
    copy.read(read.data());
    CHECK(read.back() == 9u);
    read.pop_back();
    CHECK(read == values);
    CHECK(later.to_host()[999] == 999u * 999u);
  }
  exec.profile.enable(true);
  early_copy<E> copy(exec, later.data(), sizeof(u32));
  parallel_for(exec, "later", 1000, square{later});
  u32 first = 1;
  copy.read(&first);
  CHECK(first == 0);
  CHECK(exec.profile.stages().at("later").launches == 1);
}

TEST_CASE_TEMPLATE("a buffer grows with slack, never shrinks, counts its bytes", E, GART_TEST_POLICIES) {
  E exec;
  {
    buffer<u64, E> a(exec, 1000);
    CHECK(a.capacity() == 1000);
    CHECK(exec.memory.current == 8000);
    a.resize(1001);
    CHECK(a.size() == 1001);
    CHECK(a.capacity() == 1251);
    void* const place = a.data();
    a.resize(1200);
    a.resize(10);
    CHECK(a.data() == place);
    CHECK(a.capacity() == 1251);
    CHECK(a.view().size() == 10);
    CHECK(exec.memory.current == 1251 * 8);
    CHECK(exec.memory.peak == 1251 * 8);
    a.release();
    CHECK(exec.memory.current == 0);
    CHECK(a.size() == 0);
    a.resize(4);
    CHECK(a.capacity() == 4);
  }
  CHECK(exec.memory.current == 0);
  CHECK(exec.memory.peak == 1251 * 8);
}

TEST_CASE_TEMPLATE("resize_keep keeps what there was", E, GART_TEST_POLICIES) {
  E exec;
  auto const host = numbers(1000);
  buffer<u32, E> a(exec, host);
  a.resize_keep(5000);
  CHECK(a.capacity() == 6250);
  a.resize_keep(6000);
  CHECK(a.size() == 6000);
  auto kept = a.to_host();
  kept.resize(1000);
  CHECK(kept == host);
  buffer<u32, E> empty(exec);
  empty.resize_keep(3);
  CHECK(empty.size() == 3);
  CHECK(empty.capacity() == 3);  // a first size is exact
}

TEST_CASE_TEMPLATE("reserving is exact, keeps contents and grows in place", E, GART_TEST_POLICIES) {
  E exec;
  auto const host = numbers(1000);
  buffer<u32, E> a(exec, host);
  a.reserve(5000);
  CHECK(a.capacity() == 5000);
  CHECK(a.to_host() == host);
  u32* const place = a.data();
  a.resize_keep(4000), a.resize_keep(5000), a.reserve(10);
  CHECK(a.data() == place);
  CHECK(a.capacity() == 5000);
  CHECK(a.size() == 5000);
  auto kept = a.to_host();
  kept.resize(1000);
  CHECK(kept == host);
  buffer<u32, E> empty(exec);
  empty.reserve(3);
  CHECK(empty.size() == 0);
  CHECK(empty.capacity() == 3);
}

TEST_CASE_TEMPLATE("moving a buffer moves its memory", E, GART_TEST_POLICIES) {
  E exec;
  auto const host = numbers(100);
  buffer<u32, E> a(exec, host);
  void* const place = a.data();
  buffer<u32, E> b(std::move(a));
  CHECK(b.data() == place);
  CHECK(a.data() == nullptr);
  CHECK(a.size() == 0);
  buffer<u32, E> c(exec, 50);
  c = std::move(b);
  CHECK(c.to_host() == host);
  CHECK(exec.memory.current == 400);
}

TEST_CASE_TEMPLATE("memory that cannot be had is refused with the bytes asked", E, GART_TEST_POLICIES) {
  E exec;
  std::size_t const asked = std::size_t{1} << 60;
  try {
    exec.deallocate(exec.allocate(asked), asked);
    FAIL("an exbibyte was allocated");
  } catch (out_of_memory const& e) {
    CHECK(e.asked == asked);
    CHECK(e.available > 0);
    CHECK(std::string(e.what()).find("train_options.max_gaussians") != std::string::npos);
  }
  CHECK(exec.memory.current == 0);
  CHECK(exec.free_bytes() > 0);
  CHECK(exec.free_bytes() < asked);
  buffer<u32, E> after(exec, numbers(10));
  CHECK(after.to_host() == numbers(10));
}

TEST_CASE_TEMPLATE("parallel_for runs every index once", E, GART_TEST_POLICIES) {
  E exec;
  for (index_t n : {0u, 1u, 255u, 256u, 257u, 1000u, 100003u}) {
    CAPTURE(n);
    buffer<u32, E> out(exec, n), more(exec, n);
    parallel_for(exec, "square", n, square{out});
    parallel_for(exec, "small blocks", n, small_blocks{more});
    auto const squares = out.to_host(), next = more.to_host();
    std::size_t wrong = 0;
    for (index_t i = 0; i < n; ++i) wrong += squares[i] != i * i || next[i] != i + 1;
    CHECK(wrong == 0);
  }
}

TEST_CASE_TEMPLATE("tile kernels share scratch between phases", E, GART_TEST_POLICIES) {
  E exec;
  for (index_t lanes : {32u, 64u, 256u, 1024u})
    for (index_t tiles : {0u, 1u, 5u, 1000u}) {
      check_tiles<1>(exec, tiles, lanes);
      check_tiles<33>(exec, tiles, lanes);
      check_tiles<256>(exec, tiles, lanes);
    }
  check_tiles<16384>(exec, 9, 256);  // 64 KiB of scratch: past the 48 KiB a block has unasked
}

TEST_CASE_TEMPLATE("atomic_add loses nothing", E, GART_TEST_POLICIES) {
  check_atomics<E, u32>();
  check_atomics<E, u64>();
  check_atomics<E, int>();
  check_atomics<E, float>();
  check_atomics<E, double>();
}

TEST_CASE_TEMPLATE("atomic_add_row loses nothing and leaves the rest of the row", E, GART_TEST_POLICIES) {
  E exec;
  buffer<float, E> rows(exec, 5 * 16);
  rows.zero();
  parallel_for(exec, "rows", 1000000, add_rows<E>{rows});
  auto const sums = rows.to_host();
  for (std::size_t i = 0; i < sums.size(); ++i) CHECK(sums[i] == (i % 16 < 12 ? 200000.0f * (i % 16 + 1) : 0.0f));
}

TEST_CASE_TEMPLATE("the profiler sums per label, nested, and only when on", E, GART_TEST_POLICIES) {
  E exec;
  buffer<u32, E> out(exec, 1000);
  parallel_for(exec, "unseen", 1000, square{out});
  exec.profile.enable(true);
  for (int step = 0; step < 3; ++step) {
    stage_scope outer(exec, "outer");
    std::string label = "inner";
    parallel_for(exec, label.c_str(), 1000, square{out});
    label = "?????";  // a label is copied, not kept
    parallel_for(exec, "inner", 1000, square{out});
    parallel_for(exec, "nothing", 0, square{out});
  }
  exec.synchronize();
  auto const& stages = exec.profile.stages();
  REQUIRE(stages.size() == 2);
  REQUIRE(stages.count("outer") == 1);
  REQUIRE(stages.count("inner") == 1);
  CHECK(stages.at("outer").launches == 3);
  CHECK(stages.at("inner").launches == 6);
  CHECK(stages.at("inner").milliseconds > 0);
  CHECK(stages.at("outer").milliseconds >= stages.at("inner").milliseconds);
  exec.profile.clear();
  CHECK(exec.profile.stages().empty());
}
