// doctest's main on each rank. Rank 0 reports; a rank that fails says so too, and ends the others, which may be waiting
// for it.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <gart/comm/mpi_comm.hpp>

#if defined(GART_TEST_CUDA)
#include <gart/exec/cuda.hpp>
#endif

#include <cstdio>
#include <sstream>
#include <string>

int main(int argc, char** argv) {
  gart::mpi_comm ranks;
#if defined(GART_TEST_CUDA)
  std::string reason;
  if (gart::cuda_devices(&reason).empty()) {
    if (ranks.rank() == 0) std::printf("skipped: no CUDA device (%s)\n", reason.c_str());
    return 0;
  }
#endif
  doctest::Context context(argc, argv);
  std::ostringstream words;
  if (ranks.rank() > 0) context.setCout(&words);
  int const code = context.run();
  if (code != 0) {
    std::fprintf(stderr, "rank %d of %d failed\n%s", ranks.rank(), ranks.size(), words.str().c_str());
    ranks.abort(code);
  }
  ranks.barrier();
  return code;
}
