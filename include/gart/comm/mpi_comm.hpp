#pragma once
/// \file
/// Ranks by MPI, in host memory: what `mpirun` started. Compiled into gart::distributed; a program needs no header of
/// MPI.
///
///   mpi_comm ranks;                                        // all that were started together
///   trainer<openmp_exec, traits, tracer, deterministic_method, mpi_comm> run(exec, options, data, start, ranks);
///
/// The first one made starts MPI, unless the program has; the program's end ends it. A program that was started alone
/// is one rank. MPI is called by one thread. Messages of any size go in pieces of at most 1 GiB.
///
/// Errors: invalid_argument for a rank that does not exist. What MPI itself finds wrong, a rank that is gone for one,
/// it says and ends all ranks.

#include <gart/comm/communicator.hpp>
#include <gart/comm/host_group.hpp>
#include <gart/core/error.hpp>

#include <memory>
#include <string>

namespace gart {

/// All ranks of an MPI job.
class mpi_comm {
 public:
  static constexpr bool alone = false;  ///< known when it runs

  /// All that were started together.
  mpi_comm();
  int rank() const;          ///< this process
  int size() const;          ///< ranks in all
  std::string host() const;  ///< the name of the machine that this rank is on
  int rank_on_host() const;  ///< which of these this is
  int sharers() const;       ///< ranks of this host, with this one: they share its memory
  /// Those, and the memory that they share.
  std::shared_ptr<host_group> on_host() const;

  /// By a policy of host memory.
  template <execution E>
  void exchange(E&, span<message const> sends, span<message const> receives) {
    static_assert(!E::device, "mpi_comm's messages are of host memory");
    exchange(sends, receives);
  }
  ///@{
  /// At once: there is nothing beside the queue.
  template <execution E>
  void begin(E& exec, span<message const> sends, span<message const> receives) {
    exchange(exec, sends, receives);
  }
  template <execution E>
  void finish(E&) {}
  ///@}
  /// Grouped; returns when all have arrived.
  void exchange(span<message const> sends, span<message const> receives);
  /// `bytes` of each.
  void all_gather(void const* mine, void* all, std::size_t bytes);
  ///@{
  /// In the order of ranks.
  void all_reduce(span<double> values);
  void all_reduce(span<u64> values);
  ///@}
  /// Of the ranks before this one.
  u64 exclusive_scan(u64 value);
  /// From the root.
  void broadcast(void* data, std::size_t bytes, int root);
  /// Waits for all.
  void barrier();
  /// By MPI-IO, for hosts that share a folder: NFS alone would write whole pages over other ranks' bytes.
  std::unique_ptr<shared_file> open_file(std::filesystem::path const& path, bool create);
  /// Ends all ranks at once with that exit code, for a rank that cannot go on. Says nothing itself.
  [[noreturn]] void abort(int code);

 private:
  struct state;
  class host_ranks;
  std::shared_ptr<state> state_;
};

}  // namespace gart
