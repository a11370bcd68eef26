#pragma once
// The policies a test body runs over: TEST_CASE_TEMPLATE("...", E, GART_TEST_POLICIES). Compiled by a host compiler
// they are the two host policies; by nvcc, with GART_TEST_CUDA, cuda_exec. Where no policy decides what is tested, but
// templates are many, GART_TEST_ONE_POLICY leaves openmp_exec on the host. GART_TEST_EACH_POLICY(X) is X(E) for each:
// explicit instantiations of what several tests use.

#include <doctest/doctest.h>

#if defined(GART_TEST_CUDA)
#include <gart/exec/cuda_launch.cuh>
#define GART_TEST_POLICIES gart::cuda_exec
#define GART_TEST_EACH_POLICY(X) X(gart::cuda_exec)
#elif defined(GART_TEST_ONE_POLICY)
#include <gart/exec/parallel.hpp>
#define GART_TEST_POLICIES gart::openmp_exec
#define GART_TEST_EACH_POLICY(X) X(gart::openmp_exec)
#else
#include <gart/exec/parallel.hpp>
#define GART_TEST_POLICIES gart::serial_exec, gart::openmp_exec
#define GART_TEST_EACH_POLICY(X) X(gart::serial_exec) X(gart::openmp_exec)
#endif

#include <cstdint>
#include <cstdlib>
#include <random>

namespace gart_test {

// The seed of property tests: GART_TEST_SEED, or another at every run; CAPTURE it so that a failure can be repeated.
inline std::uint64_t seed() {
  static std::uint64_t const value = [] {
    if (char const* text = std::getenv("GART_TEST_SEED"))
      return static_cast<std::uint64_t>(std::strtoull(text, nullptr, 10));
    return static_cast<std::uint64_t>(std::random_device{}());
  }();
  return value;
}

}  // namespace gart_test
