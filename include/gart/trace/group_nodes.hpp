#pragma once
/// \file
/// The nodes of a tree that a ray of eight lanes (trace/group_walk.hpp) is still to open. Each lane keeps some of its
/// own, in no order, so that lanes put and take nodes without a word to one another. Several are taken at a time: the
/// nearest of all, then the nearest of those lanes that gave none yet. A lane without room loses its farthest.
///
/// All groups of a warp call each function together; arguments say which of them it is for.

#include <gart/trace/group_hits.hpp>

namespace gart { inline namespace GART_ISA {

/// The memory that the lanes share.
template <int Room>
struct group_nodes_memory {
  u32 key[Room][group_lanes];   ///< bits of the distance where the ray enters it
  u32 node[Room][group_lanes];  ///< its number
};

/// A ray's nodes, Room of a lane at most. Before AtOnce are opened, each lane has room for one child of each.
template <int Room, int AtOnce>
class group_nodes {
 public:
  static constexpr u32 gone = ~u32{0};  ///< a key past all others

  /// Of none.
  GART_HD explicit group_nodes(group_nodes_memory<Room>& memory) : m_(memory) {}

  /// The root alone; nothing where the group has no ray.
  GART_HD GART_INLINE void start(bool here) {
    each_in_group([&](int l) { m_.key[0][l] = m_.node[0][l] = 0, count_[l] = here && l == 0 ? 1 : 0; });
  }
  /// Drops all.
  GART_HD GART_INLINE void drop() {
    each_in_group([&](int l) { count_[l] = 0; });
  }
  /// One more of a lane.
  GART_HD GART_INLINE void put(int lane, u32 key, u32 node) {
    int const to = count_[lane]++;
    m_.key[to][lane] = key, m_.node[to][lane] = node;
  }

  /// The key of the nearest; gone where there is none.
  GART_HD GART_INLINE u32 nearest() {
    each_in_group([&](int l) {
      least_[l] = gone, at_[l] = 0;
      for (int k = 0; k < count_[l]; ++k)
        if (m_.key[k][l] < least_[l]) least_[l] = m_.key[k][l], at_[l] = k;
    });
    return least_in_group([&](int l) { return least_[l]; });
  }
  /// Takes nodes off whose keys are at most `reach`. `first`: what nearest() said just before. `taken`: which there
  /// are.
  GART_HD GART_INLINE void take(bool here, u32 first, u32 reach, u32 (&nodes)[AtOnce], bool (&taken)[AtOnce]) {
    group_values<u32> own;
    each_in_group([&](int l) { own[l] = m_.node[at_[l]][l]; });
    GART_UNROLL
    for (int i = 0; i < AtOnce; ++i) {
      u32 const key = i == 0 ? first : least_in_group([&](int l) { return least_[l]; });
      int const lane = first_lane_of(least_, key);
      taken[i] = here && key <= reach;
      u32 const node = of_lane(own, lane);  // by all groups, those that take none too
      nodes[i] = taken[i] ? node : 0;
      each_in_group([&](int l) {
        if (l != lane) return;
        if (taken[i]) take_off(l, at_[l]);
        least_[l] = gone;
      });
    }
  }

  /// Whether some lane of some group has no room.
  GART_HD GART_INLINE bool any_full() {
    return any_in_any_group([&](int l) { return is_full(l); });
  }
  /// The lanes without room lose one each. The least key that is lost, or gone.
  GART_HD GART_INLINE u32 lose_farthest() {
    group_values<u32> lost;
    each_in_group([&](int l) {
      lost[l] = gone;
      if (!is_full(l)) return;
      int at = 0;
      for (int k = 1; k < count_[l]; ++k)
        if (m_.key[k][l] > m_.key[at][l]) at = k;
      lost[l] = m_.key[at][l], take_off(l, at);
    });
    return least_in_group([&](int l) { return lost[l]; });
  }

 private:
  GART_HD GART_INLINE bool is_full(int lane) { return count_[lane] + AtOnce > Room; }
  // The last takes its place.
  GART_HD GART_INLINE void take_off(int lane, int at) {
    int const last = --count_[lane];
    m_.key[at][lane] = m_.key[last][lane], m_.node[at][lane] = m_.node[last][lane];
  }

  group_nodes_memory<Room>& m_;
  group_values<int> count_, at_;  // nodes of each lane; where its nearest is
  group_values<u32> least_;       // the key of that
};

}}  // namespace gart::GART_ISA
