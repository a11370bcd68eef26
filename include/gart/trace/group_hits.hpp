#pragma once
/// \file
/// The hits of a ray of eight lanes (trace/group_walk.hpp) that are found and not yet passed on. They are in no order.
/// Those that are certain are put in order, by the number of hits before each. Where there is no room the farthest is
/// lost. From then on, hits that are passed on lie before the nearest hit or node that was lost.
///
/// All groups of a warp call each function together; arguments say which of them it is for.

#include <gart/bvh/walk.hpp>
#include <gart/trace/lane_group.hpp>
#include <gart/trace/lane_hits.hpp>

namespace gart { inline namespace GART_ISA {

/// The memory that the lanes share.
template <int Room>
struct group_hits_memory {
  lane_hits<Room, 1> waiting;  ///< in no order
  u8 order[Room];              ///< places of those that are certain
};

/// The first lane that has a value; some lane does.
template <class T>
GART_HD GART_INLINE int first_lane_of(group_values<T>& values, T value) {
  return lowest_bit(group_where([&](int l) { return values[l] == value; }));
}

/// A ray's hits, Room of them at most.
template <int Room>
class group_hits {
  static_assert(Room % group_lanes == 0 && Room <= 256);

 public:
  static constexpr u32 gone = ~u32{0};     ///< bits of a distance past all others
  static constexpr u64 nothing = ~u64{0};  ///< a key past all others

  /// Of none.
  GART_HD explicit group_hits(group_hits_memory<Room>& memory) : m_(memory) {}

  /// The order of hits in one number.
  GART_HD GART_INLINE static u64 key_of(float t, u32 id) { return u64{float_to_bits(t)} << 32 | id; }

  /// Empties it; nothing was lost.
  GART_HD GART_INLINE void clear() { count_ = 0, asked_ = 0, lost_ = nothing; }
  /// Drops all that wait, where the ray is done with.
  GART_HD GART_INLINE void drop() { count_ = 0; }
  GART_HD int size() const { return count_; }  ///< hits that wait
  GART_HD u64 lost() const { return lost_; }   ///< key of the nearest that was lost; nothing: none
  /// Something of that key was lost.
  GART_HD GART_INLINE void lose(u64 key) { lost_ = key < lost_ ? key : lost_; }

  /// Takes hits, one a lane where it is new. `comes`: some may be.
  GART_HD GART_INLINE void add(bool comes, group_values<hit>& found, group_values<bool>& is_new) {
    while (in_any_group(comes && count_ + group_lanes > Room)) lose_farthest(comes && count_ + group_lanes > Room);
    u32 const all = group_where([&](int l) { return is_new[l] && key_of(found[l].t, found[l].id) < lost_; });
    each_in_group([&](int l) {
      if (all >> l & 1u) m_.waiting.put(count_ + count_bits(bits_before(all, l)), found[l]);
    });
    group_barrier();
    count_ += count_bits(all);
    if (all) asked_ = 0;
  }

  /// Whether some may be certain, where nothing that is left comes before `bound`.
  GART_HD GART_INLINE bool may_pass(u32 bound) const { return count_ > 0 && bound > asked_; }
  /// Puts those in order, and says how many they are; 0 where it is not for this group.
  GART_HD GART_INLINE int put_in_order(bool here, u32 bound) {
    int const waiting = here ? count_ : 0;
    group_values<int> found;
    each_in_group([&](int l) {
      found[l] = 0;
      for (int k = l; k < waiting; k += group_lanes)
        if (is_certain(k, bound)) m_.order[rank_of(k)] = static_cast<u8>(k), ++found[l];
    });
    int const certain = sum_in_group([&](int l) { return found[l]; });
    group_barrier();
    return certain;
  }
  /// The hit at a place of the order.
  GART_HD GART_INLINE hit at(int k) const { return m_.waiting.at(m_.order[k]); }
  /// Takes those off that were put in order.
  GART_HD GART_INLINE void take_off(bool here, u32 bound) {
    int const waiting = here ? count_ : 0;
    int kept = 0;
    group_values<u32> least;
    each_in_group([&](int l) { least[l] = gone; });
    for (int first = 0; in_any_group(first < waiting); first += group_lanes) {
      group_values<hit> own;
      group_values<bool> stays;
      each_in_group([&](int l) {
        int const k = first + l;
        stays[l] = k < waiting && !is_certain(k, bound);
        if (!stays[l]) return;
        own[l] = m_.waiting.at(k);
        u32 const t = float_to_bits(own[l].t);
        least[l] = t < least[l] ? t : least[l];
      });
      u32 const all = group_where([&](int l) { return stays[l]; });
      group_barrier();
      each_in_group([&](int l) {
        if (stays[l]) m_.waiting.put(kept + count_bits(bits_before(all, l)), own[l]);
      });
      group_barrier();
      kept += count_bits(all);
    }
    u32 const next = least_in_group([&](int l) { return least[l]; });
    if (here) count_ = kept, asked_ = next;
  }

 private:
  GART_HD GART_INLINE bool is_certain(int place, u32 bound) const {
    float const t = m_.waiting.t[place];
    return float_to_bits(t) < bound && key_of(t, m_.waiting.id[place]) < lost_;
  }
  // How many hits come before one.
  GART_HD GART_INLINE int rank_of(int place) const {
    float const t = m_.waiting.t[place];
    int rank = 0, beside = 0;
    for (int k = 0; k < count_; ++k) rank += m_.waiting.t[k] < t, beside += m_.waiting.t[k] == t;
    if (beside == 1) return rank;
    u32 const id = m_.waiting.id[place];
    for (int k = 0; k < count_; ++k) rank += m_.waiting.t[k] == t && m_.waiting.id[k] < id;
    return rank;
  }
  GART_HD GART_INLINE void lose_farthest(bool here) {
    group_values<u64> most;
    group_values<u32> at;
    each_in_group([&](int l) {
      most[l] = nothing, at[l] = 0;
      for (int k = l; k < count_; k += group_lanes) {
        u64 const key = ~key_of(m_.waiting.t[k], m_.waiting.id[k]);
        if (key < most[l]) most[l] = key, at[l] = static_cast<u32>(k);
      }
    });
    u64 const least = least_in_group([&](int l) { return most[l]; });
    u32 const place = of_lane(at, first_lane_of(most, least));
    if (here) --count_, lose(~least);
    group_barrier();
    each_in_group([&](int l) {
      if (here && l == 0) m_.waiting.put(static_cast<int>(place), m_.waiting.at(count_));
    });
    group_barrier();
  }

  group_hits_memory<Room>& m_;
  int count_ = 0;
  u32 asked_ = 0;  // none is certain before this distance
  u64 lost_ = nothing;
};

}}  // namespace gart::GART_ISA
