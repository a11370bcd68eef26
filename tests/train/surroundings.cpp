// What a trainer takes from its surroundings where the options say nothing: the hit buffer's budget from the memory
// that is free.
#include "runs.hpp"

#include <gart/exec/serial.hpp>

#include <string>

using namespace gart_test;

namespace {

// All but out of memory: the Gaussians have room, the hit buffer has none.
struct poor_exec : gart::serial_exec {
  static std::size_t free_bytes() { return 80'000; }
};
static_assert(gart::host_execution<poor_exec>);

template <class Method, class E>
std::string taken_by(E& exec, gart::dataset const& data, gart::u64 hit_memory) {
  gart::train_options options;
  options.hit_memory = hit_memory, options.densify = gart::densify_kind::none;
  run_of<E, Method> run(exec, options, data, cloud(5, 0.7f));
  return run.step().backward;
}

}  // namespace

TEST_CASE("without a budget the hit buffer takes half of free memory") {
  gart::serial_exec exec;
  auto const data = capture(exec, 3);
  CHECK(taken_by<gart::primitive_method>(exec, data, 0) == "primitive");
  poor_exec poor;
  CHECK(taken_by<gart::primitive_method>(poor, data, 0) == "pixel");
  CHECK(taken_by<gart::primitive_method>(poor, data, gart::u64{1} << 40) == "primitive");
  CHECK(taken_by<gart::deterministic_method>(poor, data, 0) == "deterministic");
}

TEST_CASE("a run without room for its Gaussians is refused in bytes") {
  gart::serial_exec exec;
  auto const data = capture(exec, 3);
  poor_exec poor;
  gart::train_options options;
  auto const made = [&] { run_of<poor_exec>(poor, options, data, cloud(5, 0.7f)); };
  options.densify = gart::densify_kind::mcmc, options.max_gaussians = 166;  // 16 bytes of 23 floats, and 112
  made();
  options.max_gaussians = 167;
  CHECK_THROWS_WITH_AS(
      made(), doctest::Contains("asked for 80160 bytes, 80000 bytes free (167 Gaussians of degree 1 on 1 rank"),
      gart::out_of_memory);
  options.max_gaussians = (1u << 28) + 1;
  CHECK_THROWS_WITH_AS(made(), doctest::Contains("train_options.max_gaussians: 268435457 Gaussians on 1 rank are more"),
                       gart::invalid_argument);
  options.densify = gart::densify_kind::none, options.max_gaussians = 1'000'000;
  made();  // it stays at 150
  options.shard_block = 4096, options.batch = 1;
  CHECK(gart::least_bytes(options, 200'000'000, 3, 1) == 211'200'000'000);
  CHECK(gart::least_bytes(options, 200'000'000, 3, 4) == (944ull + 176) * 50'000'384);  // blocks are whole
  options.batch = 4;
  CHECK(gart::least_bytes(options, 200'000'000, 3, 4) == (944ull + 112) * 50'000'384);
  options.dropout = 0.1f;  // an opacity
  CHECK(gart::least_bytes(options, 200'000'000, 3, 4) == (944ull + 112 + 4) * 50'000'384);
  options.render.antialias = 0.3f;  // the narrowest filter, three sizes and an opacity
  CHECK(gart::least_bytes(options, 200'000'000, 3, 4) == (944ull + 112 + 24) * 50'000'384);
  options.batch = 1;  // seen once to be sent, and once by the rank that finishes it
  CHECK(gart::least_bytes(options, 200'000'000, 3, 4) == (944ull + 176 + 40) * 50'000'384);
}
