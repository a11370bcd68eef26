// doctest's main, and the exit code 77 (skipped) for the CUDA tests on a machine without a device.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <cstdio>

#if defined(GART_TEST_CUDA)
#include <gart/exec/cuda.hpp>
#endif

int main(int argc, char** argv) {
#if defined(GART_TEST_CUDA)
  std::string reason;
  if (gart::cuda_devices(&reason).empty()) {
    std::printf("skipped: no CUDA device (%s)\n", reason.c_str());
    return 77;
  }
#endif
  return doctest::Context(argc, argv).run();
}
