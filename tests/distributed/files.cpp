// Files that ranks write and read together: byte for byte those of one rank, and whole or not there.
#include <gart/comm/mpi_comm.hpp>
#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>
#include <gart/train/checkpoint_part.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>

#include <sys/resource.h>
#include <unistd.h>

using namespace gart;
namespace fs = std::filesystem;

namespace {

constexpr index_t block = 8;

// Bytes in memory, of which every one is written once.
struct memory_file final : shared_file {
  std::vector<u8> bytes;
  std::vector<int> writes;
  void write(u64 at, void const* data, std::size_t n) override {
    if (bytes.size() < at + n) bytes.resize(at + n), writes.resize(at + n);
    if (n) std::memcpy(bytes.data() + at, data, n);
    for (std::size_t i = 0; i < n; ++i) ++writes[at + i];
  }
  void close() override {}
  bool each_once() const {
    return std::all_of(writes.begin(), writes.end(), [](int n) { return n == 1; });
  }
};

// Numbers that no two rows share.
gaussian_model model_of(std::size_t n, int degree, float from) {
  gaussian_model m;
  m.resize(n, degree);
  for_each_array(
      [&](parameter_array const&, auto& values) {
        for (float& x : values) x = from, from += 0.37f;
      },
      m);
  return m;
}

training_state state_of(std::size_t n, int degree, bool statistics) {
  training_state s;
  s.scene = model_of(n, degree, 1), s.first = model_of(n, degree, -50), s.second = model_of(n, degree, 3000);
  s.step = 77, s.seed = 9;
  if (!statistics) return s;
  std::vector<float> sum;
  std::vector<u32> touched;
  for (std::size_t i = 0; i < n; ++i)
    sum.push_back(static_cast<float>(i) + 0.5f), touched.push_back(static_cast<u32>(3 * i));
  s.parts.set("error_growth/error_sum", sum), s.parts.set("adc/touched", touched);
  s.parts.set("gaussians/own", sum);
  s.parts.set("exposure", std::vector<float>(24, 0.25f)), s.parts.set("exposure/visits", std::vector<u32>{4, 5});
  return s;
}

template <class T>
std::vector<T> part_of(std::vector<T> const& all, row_owners const& owners) {
  std::vector<T> mine;
  for (std::size_t g = 0; g < all.size(); ++g)
    if (owners.owns(g)) mine.push_back(all[g]);
  return mine;
}
training_state part_of(training_state const& all, row_owners const& owners) {
  training_state mine = all;
  for (gaussian_model* each : {&mine.scene, &mine.first, &mine.second}) *each = rows_of(*each, owners);
  for (auto const& [name, values] : all.parts.bytes)
    if (of_gaussians(name)) mine.parts.set(name, part_of(all.parts.get<u32>(name), owners));
  return mine;
}

bool same(gaussian_model const& a, gaussian_model const& b) {
  bool equal = a.sh_degree == b.sh_degree;
  for_each_array([&](parameter_array const&, auto const& x, auto const& y) { equal = equal && x == y; }, a, b);
  return equal;
}
bool same(training_state const& a, training_state const& b) {
  return same(a.scene, b.scene) && same(a.first, b.first) && same(a.second, b.second) && a.step == b.step &&
         a.seed == b.seed && a.parts.bytes == b.parts.bytes;
}

std::vector<u32> sum_of(std::vector<std::vector<u32>> const& shares) {
  std::vector<u32> sums(shares[0].size());
  for (auto const& mine : shares)
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] ^= mine[i];
  return sums;
}

// A folder of this test's ranks, which the first one makes and removes.
struct folder {
  mpi_comm ranks;
  fs::path path = "distributed_files_" + std::to_string(ranks.size());
  folder() {
    if (ranks.rank() == 0) fs::remove_all(path), fs::create_directory(path);
    ranks.barrier();
  }
  ~folder() {
    ranks.barrier();
    if (ranks.rank() == 0) fs::remove_all(path);
    ranks.barrier();
  }
  std::vector<std::string> names() const {
    ranks_barrier();
    std::vector<std::string> out;
    for (auto const& entry : fs::directory_iterator(path)) out.push_back(entry.path().filename().string());
    std::sort(out.begin(), out.end());
    ranks_barrier();
    return out;
  }

 private:
  void ranks_barrier() const { mpi_comm(ranks).barrier(); }
};

std::string error_of(std::function<void()> const& f) {
  try {
    f();
  } catch (io_error const& e) {
    return e.what();
  }
  return {};
}
bool holds(std::string const& text, std::string const& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("any ranks write one checkpoint and read their rows of it") {
  fs::path const name = "distributed_rows_" + std::to_string(::getpid()) + ".gart";
  for (std::size_t const n : {0u, 1u, 8u, 9u, 100u})
    for (bool const statistics : {false, true}) {
      training_state const all = state_of(n, n == 100 ? 3 : 1, statistics);
      write_checkpoint(name, all);
      auto const expected = read_file(name);
      for (int ranks = 1; ranks <= 4; ++ranks) {
        CAPTURE(n);
        CAPTURE(ranks);
        std::vector<training_state> parts;
        for (int r = 0; r < ranks; ++r) parts.push_back(part_of(all, {ranks, r, block}));
        std::vector<checkpoint_rows> writers;
        std::vector<u64> bytes;
        for (int r = 0; r < ranks; ++r) {
          writers.emplace_back(parts[static_cast<std::size_t>(r)], row_owners{ranks, r, block});
          std::vector<u64> const mine = writers.back().bytes();
          bytes.resize(mine.size());
          for (std::size_t i = 0; i < mine.size(); ++i) bytes[i] += mine[i];
        }
        std::vector<std::vector<u32>> shares;
        for (auto& writer : writers) writer.place(bytes), shares.push_back(writer.checksum_shares());
        memory_file file;
        for (auto const& writer : writers) writer.write(file, sum_of(shares));
        CHECK(file.bytes == expected);
        CHECK(file.each_once());

        shares.clear();
        std::vector<checkpoint_rows_reader> readers;
        for (int r = 0; r < ranks; ++r) {
          readers.emplace_back(name, row_owners{ranks, r, block});
          CHECK(same(readers.back().state(), parts[static_cast<std::size_t>(r)]));
          shares.push_back(readers.back().checksum_shares());
        }
        CHECK_NOTHROW(readers[0].require(sum_of(shares)));
        if (!shares[0].empty()) ++shares[0].back();
        CHECK_THROWS_AS(readers[0].require(sum_of(shares)), io_error);
      }
    }
  ::unlink(name.c_str());
}

TEST_CASE("any ranks write one splat PLY and read their rows of it") {
  fs::path const name = "distributed_rows_" + std::to_string(::getpid()) + ".ply";
  splat_traits const traits{{"near", "0.5"}};
  for (int degree = 0; degree <= 3; ++degree)
    for (std::size_t const n : {0u, 5u, 8u, 77u}) {
      gaussian_model const all = model_of(n, degree, 1);
      write_splat_ply(name, all, traits);
      auto const expected = read_file(name);
      for (int ranks = 1; ranks <= 4; ++ranks) {
        CAPTURE(n);
        CAPTURE(ranks);
        CAPTURE(degree);
        memory_file file;
        for (int r = 0; r < ranks; ++r) {
          row_owners const owners{ranks, r, block};
          write_splat_ply_rows(file, name, rows_of(all, owners), owners, n, traits);
          u64 total = 99;
          splat_traits found;
          CHECK(same(read_splat_rows(name, owners, total, &found), rows_of(all, owners)));
          CHECK(total == n);
          CHECK(found == traits);
        }
        CHECK(file.bytes == expected);
        CHECK(file.each_once());
      }
    }

  // A number that is none is named by the vertex's number in the file, whoever reads it.
  gaussian_model odd = model_of(30, 0, 1);
  odd.opacity[21] = std::numeric_limits<float>::quiet_NaN();
  write_splat_ply(name, odd);
  u64 total = 0;
  CHECK_NOTHROW(read_splat_rows(name, {3, 0, block}, total));
  CHECK(holds(error_of([&] { read_splat_rows(name, {3, 2, block}, total); }), "vertex 21, property opacity is NaN"));
  auto const whole = read_file(name);
  write_file(name, std::string_view(reinterpret_cast<char const*>(whole.data()), whole.size() - 5));
  CHECK(holds(error_of([&] { read_splat_rows(name, {3, 0, block}, total); }), "truncated"));

  // Text has no places to go to: it is read whole.
  std::string text = "ply\nformat ascii 1.0\nelement vertex 20\n";
  for (char const* p : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                        "rot_0", "rot_1", "rot_2", "rot_3"})
    text += std::string("property float ") + p + "\n";
  text += "end_header\n";
  for (int i = 0; i < 20; ++i) text += std::to_string(i) + " 0 0 0 0 0 0 0 0 0 1 0 0 0\n";
  write_file(name, text);
  gaussian_model const second = read_splat_rows(name, {2, 1, block}, total);
  CHECK(total == 20);
  REQUIRE(second.size() == 8);
  CHECK(second.mean[0] == 8);
  ::unlink(name.c_str());
}

TEST_CASE("ranks write and read a checkpoint together") {
  folder const here;
  mpi_comm ranks = here.ranks;
  row_owners const owners{ranks.size(), ranks.rank(), block};
  training_state const all = state_of(100, 1, true);
  write_checkpoint_collectively(ranks, owners, here.path / "all.gart", part_of(all, owners));
  if (ranks.rank() == 0) write_checkpoint(here.path / "one.gart", all);
  CHECK(here.names() == std::vector<std::string>{"all.gart", "one.gart"});
  CHECK(read_file(here.path / "all.gart") == read_file(here.path / "one.gart"));
  CHECK(same(read_checkpoint_collectively(ranks, owners, here.path / "one.gart"), part_of(all, owners)));

  // A byte that is another is seen by all, whoever has it.
  for (double const share : {0.2, 0.5, 0.9}) {
    if (ranks.rank() == 0) {
      auto bytes = read_file(here.path / "one.gart");
      bytes[static_cast<std::size_t>(share * static_cast<double>(bytes.size()))] ^= 4;
      write_file(here.path / "odd.gart", std::string_view(reinterpret_cast<char const*>(bytes.data()), bytes.size()));
    }
    ranks.barrier();
    std::string const said = error_of([&] { read_checkpoint_collectively(ranks, owners, here.path / "odd.gart"); });
    CAPTURE(said);
    CHECK(holds(said, "odd.gart: "));
    CHECK(holds(said, "damaged"));
    ranks.barrier();
  }
}

TEST_CASE("where one rank cannot write, all fail; the old file stays") {
  folder const here;
  mpi_comm ranks = here.ranks;
  row_owners const owners{ranks.size(), ranks.rank(), block};
  training_state const all = state_of(400, 3, true), mine = part_of(all, owners);
  fs::path const path = here.path / "run.gart";
  write_checkpoint_collectively(ranks, owners, path, mine);
  auto const before = read_file(path);
  ranks.barrier();
  auto const named = [&](std::string const& said, int rank) {
    return ranks.size() == 1 ||
           holds(said, "rank " + std::to_string(rank) + " of " + std::to_string(ranks.size()) + " (" + ranks.host());
  };
  auto const check = [&](std::string const& said, int rank, char const* why) {
    CAPTURE(said);
    CHECK(named(said, rank));
    CHECK(holds(said, "run.gart"));
    CHECK(holds(said, why));
    CHECK_FALSE(holds(said, ".tmp"));
    CHECK(here.names() == std::vector<std::string>{"run.gart"});
  };

  // The last rank's disk is full: it may write no byte past one of the file. What is written there first is the
  // first's.
  if (ranks.size() > 1) {
    int const last = ranks.size() - 1;
    rlimit was{};
    getrlimit(RLIMIT_FSIZE, &was);
    auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
    rlimit const few{200, was.rlim_max};
    if (ranks.rank() == last) setrlimit(RLIMIT_FSIZE, &few);
    std::string const said = error_of([&] { write_checkpoint_collectively(ranks, owners, path, mine); });
    if (ranks.rank() == last) setrlimit(RLIMIT_FSIZE, &was);
    std::signal(SIGXFSZ, handler);
    check(said, last, "cannot be written: ");
    CHECK(read_file(path) == before);
    ranks.barrier();
  }

  check(error_of([&] { write_checkpoint_collectively(ranks, owners, here.path / "none" / "run.gart", mine); }), 0,
        "cannot be created");
  ranks.barrier();
  if (ranks.rank() == 0) fs::remove(path), fs::create_directories(path / "in the way");
  ranks.barrier();
  check(error_of([&] { write_checkpoint_collectively(ranks, owners, path, mine); }), 0, "cannot be replaced");
}
