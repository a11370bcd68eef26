#pragma once
/// \file
/// The ranks on one host, and memory that they share: each photograph is read once and held once (io/dataset.hpp). All
/// of them make the same calls in the same order.

#include <gart/core/types.hpp>

#include <cstddef>
#include <memory>

namespace gart {

/// Ranks of one host.
class host_group {
 public:
  /// Older allocations stay.
  virtual ~host_group() = default;
  virtual int rank() const = 0;  ///< which one this is, 0 to size() - 1
  virtual int size() const = 0;  ///< ranks on this host
  /// `bytes` of each, in the order of ranks, to all.
  virtual void all_gather(void const* mine, void* all, std::size_t bytes) = 0;
  /// Waits for all ranks. Then all see what each has written to shared memory.
  virtual void barrier() = 0;
  /// The same memory on all of them, of so many bytes. Null on all where the host has too little of that kind. No rank
  /// waits for another to give it back: it stays while one of them runs. Errors: out_of_memory.
  virtual std::shared_ptr<void> allocate(u64 bytes) = 0;
};

}  // namespace gart
