#pragma once
// The ranks that a launcher (mpirun, srun) started this program as. Rank 0 prints and writes. Ranks agree on decisions
// that depend on a clock or a signal, so all do the same.

#include <gart/core/types.hpp>

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

namespace gart {
class host_group;
class mpi_comm;
}

namespace gart_cli {

class ranks {
 public:
  // The number of processes that the launcher has started, and this one's number; without a launcher 1 and 0. Starts
  // nothing.
  static int launched();
  static int launched_rank();

  static bool const built;  // with MPI

  // Replaces this process by MPI's launcher. It starts this command line as one rank for each of `gpus` GPUs of this
  // host. Returns if `gpus` is 1, or if a launcher already started the ranks. Throws usage_error where there are fewer
  // GPUs, or no launcher.
  static void launch_on(int gpus, char** argv);
  // Starts MPI where several were launched, or `wanted` says that one needs it. usage_error where this build has none.
  static void start(bool wanted);
  // Null where it was not started.
  static gart::mpi_comm* comm();
  static int size();
  static int rank();
  // The ranks of this host where there are several; else null.
  static gart::host_group* on_host();
  // Whether this rank takes part i of work dealt out in turn.
  static bool takes(std::size_t i) { return i % static_cast<std::size_t>(size()) == static_cast<std::size_t>(rank()); }
  // "rank 2 of 4 (node1): " where there are several, else nothing.
  static std::string name();

  // Rank 0's, on all of them.
  template <class T>
  static T agreed(T value) {
    static_assert(std::is_trivially_copyable_v<T>);
    broadcast(&value, sizeof value);
    return value;
  }
  static std::string agreed_text(std::string text) {
    text.resize(agreed(text.size()));
    broadcast(text.data(), text.size());
    return text;
  }
  // What each has, on all of them, in their order.
  template <class T>
  static std::vector<T> of_all(T const& mine) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> all(static_cast<std::size_t>(size()), mine);
    gather(&mine, all.data(), sizeof mine);
    return all;
  }
  // The messages of all ranks, on all ranks.
  static std::vector<std::string> gathered(std::string const& mine);
  // The largest of all.
  static gart::u64 largest(gart::u64 value);
  static void barrier();
  // After an error of this rank's: ends the others too. Rank 0 reports an error that all ranks meet; the others wait a
  // second for that.
  static void wait_to_speak();
  [[noreturn]] static void end_all(int code);

 private:
  static void broadcast(void* data, std::size_t bytes);
  static void gather(void const* mine, void* all, std::size_t bytes);
};

}  // namespace gart_cli
