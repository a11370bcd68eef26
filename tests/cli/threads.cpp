// How many threads the program takes of a machine.

#include "program.hpp"

#include <threads.hpp>

#include <doctest/doctest.h>

using namespace cli_test;

TEST_CASE("a cgroup's quota is the least of those above it") {
  folder const here;
  auto const put = [&](std::string const& group, std::string const& text) {
    fs::create_directories(here / ("mount" + group));
    gart::write_file(here / ("mount" + group) / "cpu.max", text);
  };
  fs::create_directories(here / "mount/a/b");
  CHECK(gart_cli::processors_of_quota(here / "mount", "/a/b") == 0);
  put("/a/b", "max 100000\n");
  CHECK(gart_cli::processors_of_quota(here / "mount", "/a/b") == 0);
  put("/a", "250000 100000\n");
  CHECK(gart_cli::processors_of_quota(here / "mount", "/a/b") == 3);
  put("", "150000 100000\n");
  CHECK(gart_cli::processors_of_quota(here / "mount", "/a/b") == 2);
  CHECK(gart_cli::processors_of_quota(here / "mount", "/") == 2);
  put("", "nothing\n");
  CHECK(gart_cli::processors_of_quota(here / "mount", "/") == 0);
  CHECK(gart_cli::processors_of_quota(here / "nowhere", "/a") == 0);
}

TEST_CASE("too large a number of threads does not end the program") {
  folder const here;
  write_capture(here / "capture");
  for (char const* before : {"OMP_NUM_THREADS=100000", "OMP_NUM_THREADS=2", "OMP_WAIT_POLICY=active"}) {
    CAPTURE(std::string(before));
    auto const run =
        here.gart("train capture --out run --iterations 3 --backend openmp --max-gaussians 60 --quiet", before);
    CHECK_MESSAGE(run.code == 0, run.err);
  }
}
