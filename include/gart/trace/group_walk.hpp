#pragma once
/// \file
/// The walk of a tree by single rays that are few: eight lanes a ray (trace/lane_group.hpp), four rays a warp. One lane
/// a ray would leave a device waiting for the longest of them. A lane tests a child, evaluates a candidate, or looks up
/// what a hit shows. Nodes are visited once, nearest first. Hits wait until they lie before all that is left.
///
/// Memory a ray: 96 nodes, 64 hits. The farthest of either are dropped where there is no room. Hits before them are
/// still passed on, and the ray walks again, strictly after its last. Where that brings no hit, one lane goes on as
/// walk_alone does.

#include <gart/trace/beam_walk.hpp>
#include <gart/trace/lane_group.hpp>

namespace gart { inline namespace GART_ISA { namespace trace_kernels {

static_assert(bvh_width == group_lanes);

// A program may take a hit in two steps, of which lanes do the first for several hits at a time.
template <class P>
concept shades_apart = requires(P const& p, typename P::state& s, hit h) {
  p.on_hit(s, h, p.shade(s, h.id));
};

// What the lanes of a ray share. Groups of a warp begin eight banks apart.
struct group_memory {
  static constexpr int node_room = 96, hit_room = 64;
  u32 key[node_room], node[node_room];  // bits of the distance of entry
  u32 candidate[2 * group_lanes];
  lane_hits<hit_room, 1> hits;      // waiting, in no order
  lane_hits<group_lanes, 1> ready;  // to be passed on, in order
  vec3 shown[group_lanes];          // by those
  u32 apart[8];
};
static_assert(sizeof(group_memory) % 128 == 32);

template <class Response, class Index, ray_program P>
class grouped_ray {
  using state_type = typename P::state;
  using ray_type = typename P::ray_type;
  static constexpr u32 gone = ~u32{0};
  static constexpr u64 nothing = ~u64{0};

 public:
  GART_HD GART_INLINE grouped_ray(Index const& index, traced_scene const& scene, P const& program, group_memory& memory,
                                  index_t i, state_type& state)
      : index_(index),
        scene_(scene),
        program_(program),
        m_(memory),
        state_(state),
        own_(program.ray_of(i, state)),
        slab_(index.slab_of(own_)),
        last_t_(start_of_ray(scene, program, i)),
        end_(end_of_ray(program, i)) {}

  GART_KERNEL GART_INLINE void trace() {
    if (index_.tree.count == 0) return;
    for (;;) {
      u64 const from = passed_;
      walk();
      if (!alive_ || lost_ == nothing) return;
      if (passed_ == from) return trace_alone();
    }
  }

 private:
  GART_HD GART_INLINE static u64 key_of(float t, u32 id) { return u64{float_to_bits(t)} << 32 | id; }

  // Once through the tree, up to where something was lost.
  GART_KERNEL GART_INLINE void walk() {
    lost_ = nothing, places_ = 1, hits_ = candidates_ = 0;
    asked_ = 0;
    group_barrier();
    each_in_group([&](int l) {
      if (l == 0) m_.key[0] = m_.node[0] = 0;
    });
    group_barrier();
    float const near = last_t_;
    for (;;) {
      group_values<u32> least, at;
      each_in_group([&](int l) {
        least[l] = gone, at[l] = 0;
        for (int k = l; k < places_; k += group_lanes)
          if (m_.key[k] < least[l]) least[l] = m_.key[k], at[l] = static_cast<u32>(k);
      });
      u32 const nearest = least_in_group([&](int l) { return least[l]; });
      if (nearest > reach()) break;  // or there is none
      u32 const bound = candidates_ > 0 && unmet_ < nearest ? unmet_ : nearest;
      if (hits_ >= group_lanes && bound > asked_) pass_on(bound);
      if (!alive_) return;
      u32 const place = of_lane(at, lowest_bit(group_where([&](int l) { return least[l] == nearest; })));
      expand(remove_node(place), nearest, near);
      if (candidates_ >= group_lanes) evaluate();
    }
    if (candidates_ > 0) evaluate();
    pass_on(gone);
  }

  // Nothing beyond is wanted.
  GART_HD GART_INLINE u32 reach() const {
    u32 const end = float_to_bits(end_), lost = static_cast<u32>(lost_ >> 32);
    return end < lost ? end : lost < gone ? lost : gone - 1;
  }

  GART_HD GART_INLINE u32 remove_node(u32 place) {
    u32 const node = m_.node[place];
    --places_;
    group_barrier();
    each_in_group([&](int l) {
      if (l == 0) m_.key[place] = m_.key[places_], m_.node[place] = m_.node[places_];
    });
    group_barrier();
    return node;
  }

  // A lane a child. `key`: where the node is entered.
  GART_HD GART_INLINE void expand(u32 node, u32 key, float near) {
    bvh_node const& n = index_.tree.nodes[node];
    group_values<u32> entry, child;
    group_values<bool> crossed;
    each_in_group([&](int c) {
      float from;
      crossed[c] = cross_child(n, c, slab_, near, end_, from);
      entry[c] = from > 0 ? float_to_bits(from) : 0, child[c] = n.child[c];
    });
    u32 const all = group_where([&](int c) { return crossed[c]; });
    u32 const inner = all & n.inner_mask(), leaves = all & n.leaf_mask();
    while (places_ + count_bits(inner) > group_memory::node_room) lose_node();
    each_in_group([&](int c) {
      if (inner >> c & 1u) {
        int const to = places_ + count_bits(bits_before(inner, c));
        m_.key[to] = entry[c], m_.node[to] = child[c];
      }
      if (leaves >> c & 1u) m_.candidate[candidates_ + count_bits(bits_before(leaves, c))] = child[c];
    });
    group_barrier();
    if (leaves) newest_ = key, unmet_ = candidates_ == 0 || key < unmet_ ? key : unmet_;
    places_ += count_bits(inner), candidates_ += count_bits(leaves);
  }

  // The farthest.
  GART_HD GART_INLINE void lose_node() {
    group_values<u32> most, at;
    each_in_group([&](int l) {
      most[l] = 0, at[l] = static_cast<u32>(l);
      for (int k = l; k < places_; k += group_lanes)
        if (m_.key[k] >= most[l]) most[l] = m_.key[k], at[l] = static_cast<u32>(k);
    });
    u32 const least = least_in_group([&](int l) { return ~most[l]; });
    remove_node(of_lane(at, lowest_bit(group_where([&](int l) { return ~most[l] == least; }))));
    lose(u64{~least} << 32);
  }
  GART_HD GART_INLINE void lose(u64 key) { lost_ = key < lost_ ? key : lost_; }

  // A lane a candidate, those that were found first.
  GART_HD GART_INLINE void evaluate() {
    while (hits_ + group_lanes > group_memory::hit_room) lose_hit();
    group_values<hit> found;
    group_values<bool> is_new;
    each_in_group([&](int l) {
      is_new[l] = l < candidates_;
      if (!is_new[l]) return;
      u32 const id = m_.candidate[l];
      ray_gaussian const g = scene_.gaussians[id];
      ray_peak const r = gart::evaluate(g, own_);
      is_new[l] = is_hit(g, r, scene_.near) && before(last_t_, last_id_, r.t, id) && key_of(r.t, id) < lost_;
      if (is_new[l]) found[l] = {r.t, id, hit_alpha<Response>(g, r.d2)};
    });
    u32 const all = group_where([&](int l) { return is_new[l]; });
    group_values<u32> rest;
    each_in_group([&](int l) {
      if (all >> l & 1u) m_.hits.put(hits_ + count_bits(bits_before(all, l)), found[l]);
      rest[l] = m_.candidate[group_lanes + l];
    });
    group_barrier();
    each_in_group([&](int l) { m_.candidate[l] = rest[l]; });
    group_barrier();
    hits_ += count_bits(all), candidates_ = candidates_ > group_lanes ? candidates_ - group_lanes : 0;
    // What is left is of the last node.
    unmet_ = newest_;
    if (all) asked_ = 0;
  }

  // Of the nearest hit, or of all bits of the keys turned: the farthest. What lanes found, for remove_hit.
  GART_HD GART_INLINE u64 least_hit(u64 turned, group_values<u64>& best, group_values<u32>& at) const {
    each_in_group([&](int l) {
      best[l] = nothing, at[l] = 0;
      for (int k = l; k < hits_; k += group_lanes) {
        u64 const key = key_of(m_.hits.t[k], m_.hits.id[k]) ^ turned;
        if (key < best[l]) best[l] = key, at[l] = static_cast<u32>(k);
      }
    });
    return least_in_group([&](int l) { return best[l]; });
  }
  // To a place of those that are ready, or (negative) to none.
  GART_HD GART_INLINE void remove_hit(u64 key, group_values<u64>& best, group_values<u32>& at, int to) {
    int const place = static_cast<int>(of_lane(at, lowest_bit(group_where([&](int l) { return best[l] == key; }))));
    --hits_;
    each_in_group([&](int l) {
      if (l != 0) return;
      if (to >= 0) m_.ready.put(to, m_.hits.at(place));
      m_.hits.put(place, m_.hits.at(hits_));
    });
    group_barrier();
  }
  GART_HD GART_INLINE void lose_hit() {
    group_values<u64> best;
    group_values<u32> at;
    u64 const key = least_hit(nothing, best, at);
    remove_hit(key, best, at, -1);
    lose(~key);
  }

  // The hits nearer than `bound`, which nothing that is left comes before.
  GART_KERNEL GART_INLINE void pass_on(u32 bound) {
    for (bool more = true; more && alive_;) {
      int count = 0;
      for (; count < group_lanes; ++count) {
        group_values<u64> best;
        group_values<u32> at;
        u64 const key = least_hit(0, best, at);
        asked_ = static_cast<u32>(key >> 32);
        more = asked_ < bound && key < lost_ && hits_ > 0;
        if (!more) break;
        remove_hit(key, best, at, count);
      }
      if (count > 0) give(count);
    }
  }

  GART_KERNEL GART_INLINE void give(int count) {
    if constexpr (shades_apart<P>) {
      each_in_group([&](int l) {
        if (l < count) m_.shown[l] = program_.shade(state_, m_.ready.id[l]);
      });
      group_barrier();
    }
    group_values<bool> alive;
    each_in_group([&](int l) {
      alive[l] = true;
      if (l != 0) return;
      for (int k = 0; k < count && alive[l]; ++k) {
        if constexpr (shades_apart<P>)
          alive[l] = program_.on_hit(state_, m_.ready.at(k), m_.shown[k]);
        else
          alive[l] = program_.on_hit(state_, m_.ready.at(k));
      }
    });
    alive_ = of_lane(alive, 0);
    last_t_ = m_.ready.t[count - 1], last_id_ = m_.ready.id[count - 1], passed_ += static_cast<u64>(count);
    group_barrier();
  }

  GART_KERNEL void trace_alone() {
    group_barrier();
    each_in_group([&](int l) {
      if (l != 0) return;
      lone_ray<Response, ray_type, group_memory::hit_room, 1> ray{scene_, own_, last_t_, last_id_, end_, m_.hits, 0};
      ray.trace(index_, program_, state_);
    });
    group_barrier();
  }

  Index const& index_;
  traced_scene const& scene_;
  P const& program_;
  group_memory& m_;
  state_type& state_;
  ray_type own_;
  slab_ray slab_;
  float last_t_;  // the last hit passed on
  u32 last_id_ = 0xffffffffu;
  float end_;           // of the ray
  u64 lost_ = nothing;  // hits before this (t, id) are certain
  u64 passed_ = 0;      // hits
  int places_ = 0, hits_ = 0, candidates_ = 0;
  u32 unmet_ = 0, newest_ = 0;  // the nearest entry of a node that candidates are of; that of the last such node
  u32 asked_ = 0;               // hits are not ready before this distance
  bool alive_ = true;
};

// The rays of a launch that are no beams, eight lanes each.
template <class Response, class Index, ray_program P>
struct walk_groups {
  static constexpr int block_size = 32, min_blocks = 24, rays_at_once = block_size / group_lanes;

  Index index;
  traced_scene scene;
  P program;
  index_t rays;
  u32 const* order;  // as walk_beams has it
  u32 const* apart;  // null: all of them

  struct scratch {
    group_memory ray[rays_at_once];
  };

  GART_KERNEL void operator()(auto const& team) const {
#if defined(__CUDA_ARCH__)
    trace(team.scratch().ray[threadIdx.x / group_lanes], team.tile() * rays_at_once + threadIdx.x / group_lanes);
#else
    for (index_t k = 0; k < rays_at_once; ++k) trace(team.scratch().ray[k], team.tile() * rays_at_once + k);
#endif
  }

 private:
  GART_KERNEL GART_INLINE void trace(group_memory& memory, index_t at) const {
    if (at >= rays || (apart && !apart[at / beam_lanes])) return;
    index_t const i = order ? order[at] : at;
    if (!program.active(i)) return;
    auto state = program.begin(i);
    grouped_ray<Response, Index, P>(index, scene, program, memory, i, state).trace();
    each_in_group([&](int l) {
      if (l == 0) program.end(i, state);
    });
  }
};

// All of them.
template <class Response, execution E, class Index, ray_program P>
void trace_groups(E& exec, char const* label, Index const& index, traced_scene const& scene, index_t rays,
                  u32 const* order, u32 const* apart, P const& program) {
  using kernel = walk_groups<Response, Index, P>;
  constexpr index_t at_once = kernel::rays_at_once;
  parallel_for(exec, label, tile_range{rays / at_once + (rays % at_once != 0), kernel::block_size},
               kernel{index, scene, program, rays, order, apart});
}

}  // namespace trace_kernels

}}  // namespace gart::GART_ISA
