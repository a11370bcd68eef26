#pragma once
/// \file
/// The nodes of a tree that a beam has yet to visit (trace/beam_walk.hpp). They lie in the memory that its lanes share.
/// Some of the nearest are taken at a time. Where room runs out, only the last one found is taken.

#include <gart/bvh/walk.hpp>
#include <gart/trace/lane_values.hpp>

namespace gart { inline namespace GART_ISA {

/// The memory of a beam.
struct beam_nodes {
  static constexpr int room = 224;                        ///< for nodes
  static constexpr int at_once = beam_lanes / bvh_width;  ///< that are taken, at most
  static constexpr u32 gone = ~u32{0};                    ///< the key of a place whose node was taken
  u32 key[room];                                          ///< bits of the distance that a node is entered at
  u32 node[room];                                         ///< by place
  u32 taken[at_once];                                     ///< nodes that were
};

/// What lanes know of it, all of them the same.
class beam_node_queue {
 public:
  int places = 0;  ///< that are used
  int nodes = 0;   ///< in them

  /// The root alone.
  template <class Team>
  GART_HD GART_INLINE void start(Team const& team, beam_nodes& s) {
    team.barrier();
    each_lane([&](int l) {
      if (l == 0) s.key[0] = s.node[0] = 0;
    });
    places = nodes = 1;
    team.barrier();
  }

  /// Puts nodes at the places from `places` on.
  GART_HD GART_INLINE void add(int count) { places += count, nodes += count; }

  /// Bits of the distance of the nearest node; larger than all where there is none.
  GART_HD GART_INLINE u32 least_key(beam_nodes const& s) const { return least_of_all(s); }

  /// Takes nodes no farther than `reach`, as many as there is room for the children of; how many. Where it is
  /// out_of_reach one was dropped; where there is no_room, none.
  template <class Team>
  GART_HD GART_INLINE int take(Team const& team, beam_nodes& s, float reach) {
    if (places + beam_lanes > beam_nodes::room || places > 2 * nodes + 2 * beam_lanes) close_gaps(team, s);
    if (nodes == 0) return 0;
    if (places + beam_lanes <= beam_nodes::room) return take_nearest(team, s, reach);
    if (places + bvh_width > beam_nodes::room) return no_room;
    return take_last(team, s, reach);
  }
  static constexpr int out_of_reach = -1, no_room = -2;  ///< what take() may say

 private:
#if defined(__CUDA_ARCH__)
  // Of a lane: the nearest of each 32nd node.
  __device__ GART_INLINE u32 least_of_lane(beam_nodes const& s, int& at) const {
    u32 least = beam_nodes::gone;
    at = 0;
    for (int k = static_cast<int>(threadIdx.x); k < places; k += beam_lanes)
      if (s.key[k] < least) least = s.key[k], at = k;
    return least;
  }
  __device__ GART_INLINE u32 least_of_all(beam_nodes const& s) const {
    int at;
    return __reduce_min_sync(0xffffffffu, least_of_lane(s, at));
  }
  // Of each lane its nearest at most: the four are the nearest of all, or almost.
  __device__ GART_INLINE int pop_nearest(beam_nodes& s, u32 reach) const {
    int at, count = 0;
    u32 key = least_of_lane(s, at);
    GART_UNROLL
    for (; count < beam_nodes::at_once; ++count) {
      u32 const least = __reduce_min_sync(0xffffffffu, key);
      if (least > reach) break;
      int const whose = lowest_bit(__ballot_sync(0xffffffffu, key == least));
      if (static_cast<int>(threadIdx.x) == whose) s.taken[count] = s.node[at], s.key[at] = key = beam_nodes::gone;
    }
    return count;
  }
#else
  u32 least_of_all(beam_nodes const& s) const {
    u32 least = beam_nodes::gone;
    for (int k = 0; k < places; ++k) least = s.key[k] < least ? s.key[k] : least;
    return least;
  }
  int pop_nearest(beam_nodes& s, u32 reach) const {
    int count = 0;
    for (; count < beam_nodes::at_once; ++count) {
      u32 const least = least_of_all(s);
      if (least > reach) break;
      int at = 0;
      while (s.key[at] != least) ++at;
      s.taken[count] = s.node[at], s.key[at] = beam_nodes::gone;
    }
    return count;
  }
#endif

  template <class Team>
  GART_HD GART_INLINE int take_nearest(Team const& team, beam_nodes& s, float reach) {
    int const count = pop_nearest(s, reach < 0 ? 0 : float_to_bits(reach));
    // The nearest is out of reach, and so are the others.
    nodes = count == 0 ? 0 : nodes - count;
    team.barrier();
    return count;
  }

  // There are no gaps.
  template <class Team>
  GART_HD GART_INLINE int take_last(Team const& team, beam_nodes& s, float reach) {
    --places, --nodes;
    bool const within = bits_to_float(s.key[places]) <= reach;
    each_lane([&](int l) {
      if (l == 0) s.taken[0] = s.node[places];
    });
    team.barrier();
    return within ? 1 : out_of_reach;
  }

  template <class Team>
  GART_HD GART_INLINE void close_gaps(Team const& team, beam_nodes& s) {
    int left = 0;
    for (int first = 0; first < places; first += beam_lanes) {
      per_lane<u32> key, node;
      each_lane([&](int l) {
        key[l] = first + l < places ? s.key[first + l] : beam_nodes::gone;
        if (key[l] != beam_nodes::gone) node[l] = s.node[first + l];
      });
      u32 const kept = lanes_where([&](int l) { return key[l] != beam_nodes::gone; });
      team.barrier();
      each_lane([&](int l) {
        if (key[l] == beam_nodes::gone) return;
        int const to = left + count_bits(bits_before(kept, l));
        s.key[to] = key[l], s.node[to] = node[l];
      });
      left += count_bits(kept);
      team.barrier();
    }
    places = left;
  }
};

}}  // namespace gart::GART_ISA
