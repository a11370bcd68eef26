#pragma once
/// \file
/// Messages of rows between ranks, in parallel with queued work. Rows that stay on a rank are written where they would
/// arrive.

#include <gart/comm/communicator.hpp>
#include <gart/shard/row_exchange_kernels.hpp>
#include <gart/shard/sharded_rows.hpp>

#include <numeric>
#include <utility>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Comm: a communicator for E.
template <execution E, class Comm>
requires communicator<Comm, E>
class row_messages {
 public:
  /// `exec` must outlive it.
  row_messages(E& exec, Comm comm) : exec_(&exec), comm_(std::move(comm)) {}

  /// The ranks.
  Comm& comm() { return comm_; }
  /// Waits for the messages that have begun.
  void finish() { comm_.finish(*exec_); }
  /// Begins to send and receive.
  void begin(std::vector<message> const& sends, std::vector<message> const& receives) {
    for (message const& m : sends) traffic_ += m.rank == comm_.rank() ? 0 : m.bytes;
    comm_.begin(*exec_, as_span(sends), as_span(receives));
  }
  /// Messages of rows of `width` floats to or from other ranks; counts[r] rows for rank r.
  std::vector<message> rows(std::vector<u64> const& counts, void* data, std::size_t width) const {
    std::vector<message> all = messages_of(counts, data, width * sizeof(float));
    std::erase_if(all, [&](message const& m) { return m.rank == comm_.rank(); });
    return all;
  }
  /// Where a kernel writes rows of `Width` T that leave from `out`; `in` is where they arrive.
  template <index_t Width, class T>
  detail::way_out<T, Width> way(std::vector<u64> const& leave, T* out, std::vector<u64> const& arrive, T* in) const {
    auto const me = static_cast<std::ptrdiff_t>(comm_.rank());
    auto const before = [&](std::vector<u64> const& counts) {
      return std::accumulate(counts.begin(), counts.begin() + me, u64{0});
    };
    return {out, in, before(leave), leave[static_cast<std::size_t>(me)], before(arrive)};
  }
  /// Counts bytes that this rank has sent to others by other means.
  void add_traffic(u64 bytes) { traffic_ += bytes; }
  /// Bytes that this rank has sent to others since the last call.
  u64 take_traffic() { return std::exchange(traffic_, u64{0}); }

 private:
  E* exec_;
  Comm comm_;
  u64 traffic_ = 0;
};

}}  // namespace gart::GART_ISA
