#pragma once
// How a stage is timed. A benchmark is a function template over the policy:
//   template <gart::execution E> void scan(benchmark::State& state, E& exec);
//   GART_BENCH("scan", scan)
// A host compiler registers it as scan/serial and scan/openmp, nvcc with GART_BENCH_CUDA as scan/cuda. What measure()
// runs is timed: wall time on hosts, device time between two events on CUDA.

#include <benchmark/benchmark.h>

#include <exception>
#include <string>

#if defined(GART_BENCH_CUDA)
#include <gart/exec/cuda_launch.cuh>
#else
#include <gart/exec/parallel.hpp>
#endif

namespace gart_bench {

#if defined(GART_BENCH_CUDA)
inline constexpr bool on_device = true;
#else
inline constexpr bool on_device = false;
#endif

template <gart::execution E, class Body>
void add_row(char const* name, Body body) {
  auto const run = [body](benchmark::State& state) {
    try {
      E exec;
      body(state, exec);
    } catch (std::exception const& error) {
      state.SkipWithError(error.what());
    }
  };
  benchmark::RegisterBenchmark((std::string(name) + "/" + E::name).c_str(), run)
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond);
}

template <class Body>
bool add(char const* name, Body body) {
#if defined(GART_BENCH_CUDA)
  add_row<gart::cuda_exec>(name, body);
#else
  add_row<gart::serial_exec>(name, body);
  add_row<gart::openmp_exec>(name, body);
#endif
  return true;
}

// Times f; `before` restores, untimed, what f consumes.
template <gart::execution E, class Before, class F>
void measure(benchmark::State& state, E& exec, Before const& before, F const& f) {
  before();
  f();  // buffers come to their size
  for (auto _ : state) {
    before();
    exec.profile.clear();
    exec.profile.enable(true);
    {
      gart::stage_scope<E> scope(exec, "measured");
      exec.profile.enable(false);  // the stages inside would add events of their own
      f();
    }
    exec.synchronize();
    state.SetIterationTime(1e-3 * exec.profile.stages().at("measured").milliseconds);
  }
}

template <gart::execution E, class F>
void measure(benchmark::State& state, E& exec, F const& f) {
  measure(
      state, exec, [] {}, f);
}

}  // namespace gart_bench

#define GART_BENCH_JOIN2(a, b) a##b
#define GART_BENCH_JOIN(a, b) GART_BENCH_JOIN2(a, b)
#define GART_BENCH(name, ...)                                \
  static bool const GART_BENCH_JOIN(registered_, __LINE__) = \
      gart_bench::add(name, [](benchmark::State& state, auto& exec) { __VA_ARGS__(state, exec); });
