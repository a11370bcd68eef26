#pragma once
/// \file
/// Ranks that each compute on a GPU. NCCL carries messages of device memory, on its own stream that waits for the
/// policy's and is waited for. MPI carries everything small, and started the ranks. Compiled into gart::nccl; a program
/// needs no header of NCCL or MPI.
///
///   mpi_comm ranks;
///   cuda_exec exec(nccl_comm::device_of(ranks));
///   nccl_comm all(ranks, nccl_comm::device_of(ranks));
///   trainer<cuda_exec, traits, tracer, primitive_method, nccl_comm> run(exec, options, data, start, all);
///
/// NCCL wants a GPU for each rank. Where two ranks share a device, all messages go through pinned host memory and MPI
/// (`transport` says so). That is correct, but slow. A rank's messages to itself are copies. Messages contain no sums,
/// so both transports give the same bits.
///
/// Memory: NCCL's buffers, some hundred MB of each device; by the host, pinned memory for one group of messages.
/// Errors: invalid_argument for a rank that does not exist, or a transport that is not available. gart::error with
/// NCCL's own words. NCCL's environment variables hold. Multicast (NCCL_NVLS_ENABLE) is off by default: it serves sums,
/// which are not used here.

#include <gart/comm/mpi_comm.hpp>
#include <gart/exec/cuda.hpp>

#include <memory>

namespace gart {

/// The carrier of messages of device memory between ranks: NCCL, pinned host memory and MPI, or the best available.
enum class device_transport { automatic, nccl, host };

/// All ranks of an MPI job, with a GPU each.
class nccl_comm {
 public:
  static constexpr bool alone = false;  ///< known when it runs

  /// `device`: the index of this rank's GPU. All ranks make it together.
  explicit nccl_comm(mpi_comm ranks = mpi_comm(), int device = 0,
                     device_transport transport = device_transport::automatic);
  /// The GPU that a rank takes: the ranks of a host take its GPUs in turn. 0 where there is none.
  static int device_of(mpi_comm const& ranks);

  int rank() const { return ranks_.rank(); }  ///< this process
  int size() const { return ranks_.size(); }  ///< ranks in all
  int sharers() const;                        ///< ranks that have this one's GPU, with it
  device_transport transport() const;         ///< which one it is: never automatic
  /// The version of NCCL, as "2.28.9".
  static std::string version();

  /// In the policy's order; by the host, returns when all have arrived.
  void exchange(cuda_exec& exec, span<message const> sends, span<message const> receives) {
    begin(exec, sends, receives), finish(exec);
  }
  /// Beside the policy's stream; by the host, as exchange.
  void begin(cuda_exec& exec, span<message const> sends, span<message const> receives);
  void finish(cuda_exec& exec);  ///< the policy's stream waits for it
  /// Of host memory.
  void exchange(span<message const> sends, span<message const> receives) { ranks_.exchange(sends, receives); }
  /// `bytes` of each, of host memory.
  void all_gather(void const* mine, void* all, std::size_t bytes) { ranks_.all_gather(mine, all, bytes); }
  ///@{
  /// In the order of ranks, of host memory.
  void all_reduce(span<double> values) { ranks_.all_reduce(values); }
  void all_reduce(span<u64> values) { ranks_.all_reduce(values); }
  ///@}
  /// Of the ranks before this one.
  u64 exclusive_scan(u64 value) { return ranks_.exclusive_scan(value); }
  /// From the root, of host memory.
  void broadcast(void* data, std::size_t bytes, int root) { ranks_.broadcast(data, bytes, root); }
  /// Waits for all ranks, not for their GPUs.
  void barrier() { ranks_.barrier(); }
  /// A file of host memory's bytes, as mpi_comm has it.
  std::unique_ptr<shared_file> open_file(std::filesystem::path const& path, bool create) {
    return ranks_.open_file(path, create);
  }

 private:
  struct state;
  mpi_comm ranks_;
  std::shared_ptr<state> state_;
};
static_assert(communicator<nccl_comm, cuda_exec>);

}  // namespace gart
