#pragma once
/// \file
/// A copy to the host that is queued before later work and read after it. copy_out waits for all that is queued. Here
/// the host waits for the copy alone, and queues more while the device is at the later work. On hosts the data is
/// copied when it is read.

#include <gart/core/isa.hpp>
#include <gart/exec/concepts.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

template <class E>
concept copies_early = requires(E& e, void* dst, void const* src, std::size_t bytes) {
  e.begin_copy_out(src, bytes);
  e.end_copy_out(dst, bytes);
};

}  // namespace detail

/// One at a time on a policy.
template <execution E>
class early_copy {
 public:
  /// Queues the copy of so many bytes. They must stay as they are until read().
  early_copy(E& exec, void const* src, std::size_t bytes) : exec_(exec), src_(src), bytes_(bytes) {
    if constexpr (detail::copies_early<E>) exec.begin_copy_out(src, bytes);
  }
  /// Waits for the copy. Call it once.
  void read(void* dst) {
    if constexpr (detail::copies_early<E>)
      exec_.end_copy_out(dst, bytes_);
    else
      exec_.copy_out(dst, src_, bytes_);
  }

 private:
  E& exec_;
  void const* src_;
  std::size_t bytes_;
};

}}  // namespace gart::GART_ISA
