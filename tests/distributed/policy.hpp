#pragma once
// The policy and the communicator of these tests: host memory and MPI; compiled by nvcc, a GPU a rank.

#include <gart/comm/mpi_comm.hpp>
#include <gart/exec/parallel.hpp>

#if defined(GART_TEST_CUDA)
#include <gart/comm/nccl_comm.hpp>
#include <gart/exec/cuda_launch.cuh>
#endif

namespace gart_test {

#if defined(GART_TEST_CUDA)
using exec_type = gart::cuda_exec;
using rank_comm = gart::nccl_comm;
inline exec_type make_exec() { return exec_type(gart::nccl_comm::device_of(gart::mpi_comm())); }
// Connecting GPUs takes a while: once.
inline rank_comm every_rank() {
  static rank_comm const all(gart::mpi_comm(), gart::nccl_comm::device_of(gart::mpi_comm()));
  return all;
}
#else
using exec_type = gart::serial_exec;
using rank_comm = gart::mpi_comm;
inline exec_type make_exec() { return {}; }
inline rank_comm every_rank() { return {}; }
#endif

}  // namespace gart_test
