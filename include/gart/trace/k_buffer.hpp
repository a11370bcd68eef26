#pragma once
/// \file
/// The nearest Capacity hits of a ray seen so far, sorted by (t, id). When it is full, hits behind its last are
/// dropped. The traversal finds them again, strictly after the last hit passed on: exact for any number of hits.

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>
#include <gart/trace/hit.hpp>

namespace gart { inline namespace GART_ISA {

/// A sorted window of hits.
template <int Capacity>
class k_buffer {
 public:
  static constexpr int capacity = Capacity;  ///< hits that fit

  /// Empties it.
  GART_HD GART_INLINE void clear() {
    count_ = 0;
#if defined(__CUDA_ARCH__)
    GART_UNROLL
    for (int k = 0; k < Capacity; ++k) entries_[k] = {3.402823466e38f, 0xffffffffu, 0};
#endif
  }
  /// Hits in it.
  GART_HD int size() const { return count_; }
  /// Whether there is no room left.
  GART_HD bool full() const { return count_ == Capacity; }
  /// No hit beyond this distance can enter.
  GART_HD GART_INLINE float far() const { return full() ? entries_[Capacity - 1].t : 3.402823466e38f; }
  /// Hit k, the nearest first.
  GART_HD hit const& operator[](int k) const { return entries_[k]; }

  /// Whether a hit would be kept.
  GART_HD GART_INLINE bool wants(float t, u32 id) const {
    return !full() || before(t, id, entries_[Capacity - 1].t, entries_[Capacity - 1].id);
  }

  /// Only what `wants` said yes to.
  GART_HD GART_INLINE void insert(hit h) {
#if defined(__CUDA_ARCH__)
    // One pass of exchanges over constant indices keeps the window in registers.
    GART_UNROLL
    for (int k = 0; k < Capacity; ++k) {
      hit const slot = entries_[k];
      bool const exchange = before(h.t, h.id, slot.t, slot.id);
      entries_[k] = exchange ? h : slot;
      h = exchange ? slot : h;
    }
    count_ += count_ < Capacity;
#else
    int k = count_ < Capacity ? count_++ : Capacity - 1;
    for (; k > 0 && before(h.t, h.id, entries_[k - 1].t, entries_[k - 1].id); --k) entries_[k] = entries_[k - 1];
    entries_[k] = h;
#endif
  }

 private:
  hit entries_[Capacity];
  int count_ = 0;
};

}}  // namespace gart::GART_ISA
