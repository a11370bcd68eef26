#pragma once
/// \file
/// The hits of each ray of a beam (trace/beam_walk.hpp) that are found and not yet passed on. Those of a ray are sorted
/// by (t, id). Each lane has a ring of Capacity in the memory that the lanes share. A full ring loses the farthest.
/// From then on, hits that are passed on lie before the nearest hit that was lost.

#include <gart/trace/hit.hpp>
#include <gart/trace/lane_values.hpp>

namespace gart { inline namespace GART_ISA {

/// The memory of all lanes.
template <int Capacity, int Lanes = beam_lanes>
struct lane_hits {
  static constexpr int count = Capacity * Lanes;  ///< of hits
  float t[count];                                 ///< distances
  u32 id[count];                                  ///< Gaussians
  float alpha[count];                             ///< opacities

  /// Of hit k of a lane: a bank a lane on a device, side by side on a host.
  GART_HD GART_INLINE static int place(int k, int lane) {
#if defined(__CUDA_ARCH__)
    return k * Lanes + lane;
#else
    return lane * Capacity + k;
#endif
  }
  /// The hit there.
  GART_HD GART_INLINE hit at(int place) const { return {t[place], id[place], alpha[place]}; }
  /// Puts one there.
  GART_HD GART_INLINE void put(int place, hit const& h) { t[place] = h.t, id[place] = h.id, alpha[place] = h.alpha; }
};

/// One lane's ring.
template <int Capacity, int Lanes = beam_lanes>
class hits_of_lane {
  using memory_type = lane_hits<Capacity, Lanes>;
  static constexpr float infinity = __builtin_huge_valf();

 public:
  /// Empties it.
  GART_HD GART_INLINE void clear() { first_ = count_ = 0, lost_t_ = infinity, lost_id_ = 0xffffffffu; }
  GART_HD int size() const { return count_; }               ///< hits in it
  GART_HD float lost_t() const { return lost_t_; }          ///< of the nearest hit that was lost; infinity: none
  GART_HD bool lost() const { return lost_t_ < infinity; }  ///< whether one was

  /// Whether there is no room left.
  GART_HD bool full() const { return count_ == Capacity; }
  /// No hit beyond this distance can enter.
  GART_HD GART_INLINE float far(memory_type const& memory, int lane) const {
    return full() ? memory.t[place(Capacity - 1, lane)] : 3.402823466e38f;
  }

  /// Takes a hit, or loses the farthest.
  GART_HD GART_INLINE void insert(memory_type& memory, int lane, hit const& h) {
    if (lost() && !before(h.t, h.id, lost_t_, lost_id_)) return;
    if (count_ == Capacity) {
      hit const farthest = memory.at(place(count_ - 1, lane));
      bool const fits = before(h.t, h.id, farthest.t, farthest.id);
      lost_t_ = fits ? farthest.t : h.t, lost_id_ = fits ? farthest.id : h.id;
      if (!fits) return;
      --count_;
    }
    int k = count_++;
    for (; k > 0; --k) {
      int const from = place(k - 1, lane);
      if (!before(h.t, h.id, memory.t[from], memory.id[from])) break;
      memory.put(place(k, lane), memory.at(from));
    }
    memory.put(place(k, lane), h);
  }

  /// Whether the nearest may be passed on, where no other is to be found before `bound`.
  GART_HD GART_INLINE bool ready(memory_type const& memory, int lane, float bound) const {
    if (count_ == 0) return false;
    int const at = place(0, lane);
    return memory.t[at] < bound && (!lost() || before(memory.t[at], memory.id[at], lost_t_, lost_id_));
  }
  /// Takes the nearest off; there must be one.
  GART_HD GART_INLINE hit pop(memory_type const& memory, int lane) {
    hit const h = memory.at(place(0, lane));
    first_ = first_ + 1 == Capacity ? 0 : first_ + 1, --count_;
    return h;
  }

 private:
  GART_HD GART_INLINE int place(int k, int lane) const {
    int const at = first_ + k;
    return memory_type::place(at >= Capacity ? at - Capacity : at, lane);
  }

  int first_, count_;
  float lost_t_;
  u32 lost_id_;
};

}}  // namespace gart::GART_ISA
