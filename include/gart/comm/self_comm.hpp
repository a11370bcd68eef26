#pragma once
/// \file
/// The communicator of one rank by itself: it has nobody to wait for. `alone` (if constexpr) leaves out everything for
/// several ranks, so it costs nothing.

#include <gart/comm/communicator.hpp>
#include <gart/core/error.hpp>

#include <cstring>

namespace gart {

/// One rank.
class self_comm {
 public:
  static constexpr bool alone = true;  ///< known when compiled

  constexpr int rank() const { return 0; }     ///< the only one
  constexpr int size() const { return 1; }     ///< one
  constexpr int sharers() const { return 1; }  ///< it has all memory
  /// Messages to itself, by the policy.
  template <execution E>
  void exchange(E& exec, span<message const> sends, span<message const> receives) {
    each_pair(sends, receives, [&](message const& from, message const& to) {
      if (to.bytes) exec.copy(to.data, from.data, to.bytes);
    });
  }
  ///@{
  /// At once.
  template <execution E>
  void begin(E& exec, span<message const> sends, span<message const> receives) {
    exchange(exec, sends, receives);
  }
  template <execution E>
  void finish(E&) {}
  ///@}
  /// In host memory.
  void exchange(span<message const> sends, span<message const> receives) {
    each_pair(sends, receives, [](message const& from, message const& to) {
      if (to.bytes) std::memcpy(to.data, from.data, to.bytes);
    });
  }
  /// A copy.
  void all_gather(void const* mine, void* all, std::size_t bytes) {
    if (bytes) std::memcpy(all, mine, bytes);
  }
  /// @{ Sums over a single rank.
  void all_reduce(span<double>) {}
  void all_reduce(span<u64>) {}
  ///@}
  /// Of no rank: 0.
  u64 exclusive_scan(u64) { return 0; }
  /// It is there.
  void broadcast(void*, std::size_t, int) {}
  /// Nobody to wait for.
  void barrier() {}

 private:
  template <class F>
  static void each_pair(span<message const> sends, span<message const> receives, F const& copy) {
    if (sends.size() != receives.size()) throw invalid_argument("exchange: a message to itself has nobody to take it");
    for (std::size_t i = 0; i < sends.size(); ++i) {
      if (sends[i].rank != 0 || receives[i].rank != 0 || sends[i].bytes != receives[i].bytes)
        throw invalid_argument("exchange: there is one rank, and its messages are taken as they are sent");
      copy(sends[i], receives[i]);
    }
  }
};
static_assert(self_comm::alone);

}  // namespace gart
