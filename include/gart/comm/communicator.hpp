#pragma once
/// \file
/// Ranks that train together: processes of one host or of several. Each has a part of the Gaussians. A communicator is
/// a handle, cheap to copy, with the members
///   static constexpr bool alone;      there is one rank, known when compiled: nothing is exchanged
///   int rank(); int size();           which one this is, 0 to size() - 1
///   int sharers();                    ranks that have their memory from where this one has it, with it
///   exchange(exec, sends, receives)   point-to-point messages as one group, in the memory of the policy, on its queue;
///                                     messages between two ranks arrive in the order of the lists; one to itself too
///   begin(exec, sends, receives)      the same beside the queue: after what was queued before it, along with what is
///                                     queued after it, which must leave its memory alone until
///   finish(exec)                      what is queued after this comes after the group that began last. One at a time:
///                                     begin and exchange finish what has begun
///   exchange(sends, receives)         the same in host memory, waited for
///   all_gather(mine, all, bytes)      `bytes` of each rank, in the order of ranks, to all
///   all_reduce(values)                element by element the sum over ranks, added in the order of ranks: the same
///                                     bits on every rank, in every run
///   exclusive_scan(value)             the sum of the values of the ranks before this one
///   broadcast(data, bytes, root)      what the root has, to all
///   barrier()                         waits for all ranks
///   open_file(path, create)           where there are several: a file that this rank writes at any place, while others
///                                     write at theirs (comm/shared_file.hpp); `create` makes it, empty
/// All but the first exchange serve small messages in host memory. Every rank makes the same calls in the same order.
/// Only open_file waits for nobody. Errors: invalid_argument for a rank that does not exist, io_error for a file. Other
/// errors of the transport end all ranks.

#include <gart/comm/shared_file.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/concepts.hpp>

#include <concepts>
#include <filesystem>
#include <memory>
#include <vector>

namespace gart {

/// Bytes to a rank, or from it.
struct message {
  int rank = 0;           ///< the other one
  void* data = nullptr;   ///< where they are, or go
  std::size_t bytes = 0;  ///< how many; the receiver knows
};

/// A group of messages, as a communicator takes them.
inline span<message const> as_span(std::vector<message> const& m) { return {m.data(), m.size()}; }

/// A communicator for the policy E.
template <class C, class E>
concept communicator = execution<E> && std::copyable<C> &&
    requires(C& c, C const& k, E& exec, span<message const> messages, void const* mine, void* all, std::size_t bytes,
             span<double> numbers, span<u64> counts) {
  { C::alone } -> std::convertible_to<bool>;
  { k.rank() } -> std::same_as<int>;
  { k.size() } -> std::same_as<int>;
  { k.sharers() } -> std::same_as<int>;
  c.exchange(exec, messages, messages);
  c.begin(exec, messages, messages);
  c.finish(exec);
  c.exchange(messages, messages);
  c.all_gather(mine, all, bytes);
  c.all_reduce(numbers);
  c.all_reduce(counts);
  { c.exclusive_scan(u64{}) } -> std::same_as<u64>;
  c.broadcast(all, bytes, 0);
  c.barrier();
  requires C::alone || requires(std::filesystem::path const& path) {
    { c.open_file(path, true) } -> std::same_as<std::unique_ptr<shared_file>>;
  };
};

}  // namespace gart
