#pragma once
/// \file
/// A ray's hits that are found and not yet passed on, sorted, in a ring of fixed capacity. The front is taken off when
/// it is certain; new ones usually go near the back.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

namespace gart { inline namespace GART_ISA {

/// A hit that waits for its turn.
struct pending_hit {
  float t;      ///< distance along the ray
  u32 place;    ///< in the tile's list
  float alpha;  ///< opacity of the hit
};

/// Capacity: a power of two.
template <int Capacity>
class hit_ring {
  static_assert((Capacity & (Capacity - 1)) == 0);

 public:
  /// Whether no hit waits.
  GART_HD bool empty() const { return count_ == 0; }
  /// The nearest hit; there must be one.
  GART_HD pending_hit const& front() const { return at(0); }
  /// Takes the nearest hit off; there must be one.
  GART_HD GART_INLINE pending_hit pop() {
    pending_hit const h = at(0);
    ++head_, --count_;
    return h;
  }

  /// `less(a, b)` is the order of hits. True where there was no room: `h` is then the farthest of all and was left out.
  template <class Less>
  GART_HD GART_INLINE bool insert(pending_hit& h, Less const& less) {
    bool const full = count_ == Capacity;
    if (full) {
      pending_hit const farthest = at(Capacity - 1);
      if (!less(h, farthest)) return true;
      --count_;
      place(h, less);
      h = farthest;
      return true;
    }
    place(h, less);
    return false;
  }

 private:
  template <class Less>
  GART_HD GART_INLINE void place(pending_hit const& h, Less const& less) {
    u32 k = count_++;
    for (; k > 0; --k) {
      pending_hit const previous = at(k - 1);
      if (!less(h, previous)) break;
      at(k) = previous;
    }
    at(k) = h;
  }
  GART_HD GART_INLINE pending_hit& at(u32 k) { return ring_[(head_ + k) & (Capacity - 1)]; }
  GART_HD GART_INLINE pending_hit const& at(u32 k) const { return ring_[(head_ + k) & (Capacity - 1)]; }

  pending_hit ring_[Capacity];
  u32 head_ = 0, count_ = 0;
};

}}  // namespace gart::GART_ISA
