#pragma once
/// \file
/// The walk of a tree by single rays that are few. Eight lanes take a ray (trace/lane_group.hpp), and a warp takes four
/// rays, step by step together. One lane a ray would leave a device waiting for the longest of them. A lane tests a
/// child, evaluates a candidate, or looks up what a hit shows. Nodes are visited once, nearest first. Hits wait until
/// they lie before all that is left.
///
/// Memory a ray: 80 nodes, 48 hits. The farthest of either are dropped where there is no room. Hits before them are
/// still passed on, and the ray walks again, strictly after its last. Where that brings no hit, one lane goes on as
/// walk_alone does.

#include <gart/trace/beam_walk.hpp>
#include <gart/trace/group_hits.hpp>

namespace gart { inline namespace GART_ISA { namespace trace_kernels {

static_assert(bvh_width == group_lanes);

// A program may take hits in three steps. First, lanes look up what several of them show, where it wants to know. Then
// all lanes alike take them in turn. Last, lanes keep what is left of each, a P::taken_hit.
template <class P>
concept shows_hits = requires(P const& p, typename P::state& s, hit h) {
  p.shade(s, h.id);
};
template <class P>
concept takes_together = requires(P const& p, typename P::state& s, group_values<typename P::taken_hit>& all) {
  p.keep_together(s, u32{1}, all);
};

// What the lanes of a ray share. Groups of a warp begin eight banks apart.
struct group_memory {
  static constexpr int node_room = 80, hit_room = 48;
  u32 key[node_room], node[node_room];  // bits of the distance of entry
  u32 candidate[2 * group_lanes];
  group_hits_memory<hit_room> hits;
  lane_hits<group_lanes, 1> ready;  // to be passed on, in order
  vec3 shown[group_lanes];          // by those
  u32 apart[12];
};
static_assert(sizeof(group_memory) % 128 == 32);

template <class Response, class Index, ray_program P>
class grouped_ray {
  using state_type = typename P::state;
  using ray_type = typename P::ray_type;
  using hits_type = group_hits<group_memory::hit_room>;
  static constexpr u32 gone = hits_type::gone;
  static constexpr int side_words = bvh_width / 4;  // of a side of a node

 public:
  GART_HD GART_INLINE grouped_ray(Index const& index, traced_scene const& scene, P const& program, group_memory& memory,
                                  index_t i, bool wanted, state_type& state)
      : index_(index),
        scene_(scene),
        program_(program),
        m_(memory),
        state_(state),
        own_(program.ray_of(i, state)),
        slab_(index.slab_of(own_)),
        last_t_(start_of_ray(scene, program, i)),
        end_(end_of_ray(program, i)),
        hits_(memory.hits),
        alive_(wanted && index.tree.count > 0) {
    each_in_group([&](int l) {
      u32 const k = static_cast<u32>(l) / side_words % 3, word = side_words * k + static_cast<u32>(l) % side_words;
      bool const backwards = slab_.inverse[static_cast<int>(k)] < 0;
      first_word_[l] = word + (backwards ? 3 * side_words : 0), final_word_[l] = word + (backwards ? 0 : 3 * side_words);
    });
  }

  GART_KERNEL GART_INLINE void trace() {
    while (in_any_group(alive_)) {
      walk();
      alive_ = alive_ && hits_.lost() != hits_type::nothing;
      bool const stuck = alive_ && !passed_;
      if (in_any_group(stuck)) trace_alone(stuck);
      alive_ = alive_ && !stuck;
    }
  }

 private:
  // Once through the tree, up to where something was lost.
  GART_KERNEL GART_INLINE void walk() {
    hits_.clear();
    passed_ = false, places_ = alive_ ? 1 : 0, candidates_ = 0;
    group_barrier();
    each_in_group([&](int l) {
      if (l == 0) m_.key[0] = m_.node[0] = 0;
    });
    group_barrier();
    float const near = last_t_;
    bool walks = alive_;
    while (in_any_group(walks)) {
      while (in_any_group(places_ + bvh_width - 1 > group_memory::node_room))
        lose_node(places_ + bvh_width - 1 > group_memory::node_room);
      group_values<u32> least, at;
      u32 const nearest = nearest_node(least, at);
      bool const done = nearest > reach();  // or there is none
      if (in_any_group(candidates_ >= group_lanes || (done && candidates_ > 0))) evaluate();
      bool const ends = walks && done && candidates_ == 0;
      u32 const bound = ends ? gone : candidates_ > 0 && unmet_ < nearest ? unmet_ : nearest;
      bool const some = hits_.may_pass(bound);
      if (in_any_group(some && (ends || hits_.size() >= group_lanes))) pass_on(some, bound);
      walks = walks && alive_ && !ends;
      if (!walks) places_ = candidates_ = 0, hits_.drop();
      bool const goes_on = walks && !done;
      if (in_any_group(goes_on)) expand(goes_on, of_lane(at, first_lane_of(least, nearest)), nearest, near);
    }
  }

  // The nearest entry of a node; gone where there is none.
  GART_HD GART_INLINE u32 nearest_node(group_values<u32>& least, group_values<u32>& at) const {
    each_in_group([&](int l) {
      least[l] = gone, at[l] = 0;
      for (int k = l; k < places_; k += group_lanes)
        if (m_.key[k] < least[l]) least[l] = m_.key[k], at[l] = static_cast<u32>(k);
    });
    return least_in_group([&](int l) { return least[l]; });
  }

  // Nothing beyond is wanted.
  GART_HD GART_INLINE u32 reach() const {
    u32 const end = float_to_bits(end_), lost = static_cast<u32>(hits_.lost() >> 32);
    return end < lost ? end : lost < gone ? lost : gone - 1;
  }

  // The node at a place gives way to its children, a lane each. `key`: where it is entered.
  GART_HD GART_INLINE void expand(bool goes_on, u32 place, u32 key, float near) {
    u32 const last = goes_on ? static_cast<u32>(places_) - 1 : 0, node = m_.node[place];
    u32 const last_key = m_.key[last], last_node = m_.node[last];
    bvh_node const& n = index_.tree.nodes[node];
    // Each word of the sides is read once for all lanes.
    group_values<u32> first, final, entry, child;
    each_in_group([&](int l) {
      u32 const* const words = &n.plane[0][0][0];
      first[l] = words[first_word_[l]], final[l] = words[final_word_[l]], child[l] = n.child[l];
    });
    auto const& head = load_grid(n);
    grid_crossing const grid(head, slab_);
    group_values<bool> crossed;
    each_in_group([&](int c) {
      u32 side[2][3];
      GART_UNROLL
      for (int k = 0; k < 3; ++k) {
        int const at = side_words * k + c / 4;
        side[0][k] = of_lane(first, at), side[1][k] = of_lane(final, at);
      }
      float from;
      crossed[c] = cross_child(grid, c, side[0], side[1], near, end_, from) && goes_on;
      entry[c] = from > 0 ? float_to_bits(from) : 0;
    });
    u32 const all = group_where([&](int c) { return crossed[c]; });
    u32 const inner = all & head.inner_mask(), leaves = all & head.leaf_mask();
    group_barrier();
    each_in_group([&](int c) {
      if (c == 0 && place < last) m_.key[place] = last_key, m_.node[place] = last_node;
      if (inner >> c & 1u) {
        int const to = static_cast<int>(last) + count_bits(bits_before(inner, c));
        m_.key[to] = entry[c], m_.node[to] = child[c];
      }
      if (leaves >> c & 1u) m_.candidate[candidates_ + count_bits(bits_before(leaves, c))] = child[c];
    });
    group_barrier();
    if (leaves) newest_ = key, unmet_ = candidates_ == 0 || key < unmet_ ? key : unmet_;
    if (goes_on) places_ += count_bits(inner) - 1, candidates_ += count_bits(leaves);
  }

  // The farthest.
  GART_HD GART_INLINE void lose_node(bool loses) {
    group_values<u32> most, at;
    each_in_group([&](int l) {
      most[l] = gone, at[l] = 0;
      for (int k = l; k < places_; k += group_lanes)
        if (~m_.key[k] <= most[l]) most[l] = ~m_.key[k], at[l] = static_cast<u32>(k);
    });
    u32 const least = least_in_group([&](int l) { return most[l]; }), place = of_lane(at, first_lane_of(most, least));
    if (loses) --places_, hits_.lose(u64{~least} << 32);
    group_barrier();
    each_in_group([&](int l) {
      if (loses && l == 0) m_.key[place] = m_.key[places_], m_.node[place] = m_.node[places_];
    });
    group_barrier();
  }

  // A lane a candidate, those that were found first.
  GART_HD GART_INLINE void evaluate() {
    group_values<hit> found;
    group_values<bool> is_new;
    group_values<u32> rest;
    each_in_group([&](int l) {
      is_new[l] = l < candidates_;
      rest[l] = m_.candidate[group_lanes + l];
      if (!is_new[l]) return;
      u32 const id = m_.candidate[l];
      ray_gaussian const g = scene_.gaussians[id];
      ray_peak const r = gart::evaluate(g, own_);
      is_new[l] = is_hit(g, r, scene_.near) && before(last_t_, last_id_, r.t, id) && r.t <= end_;
      if (is_new[l]) found[l] = {r.t, id, hit_alpha<Response>(g, r.d2)};
    });
    group_barrier();
    each_in_group([&](int l) { m_.candidate[l] = rest[l]; });
    hits_.add(candidates_ > 0, found, is_new);
    candidates_ = candidates_ > group_lanes ? candidates_ - group_lanes : 0;
    // What is left is of the last node.
    unmet_ = newest_;
  }

  // The hits nearer than `bound`, which nothing that is left comes before; eight at a time.
  GART_KERNEL GART_INLINE void pass_on(bool some, u32 bound) {
    int const certain = hits_.put_in_order(some, bound);
    for (int first = 0; in_any_group(alive_ && first < certain); first += group_lanes) {
      int const left = alive_ ? certain - first : 0;
      give(first, left < group_lanes ? left : group_lanes);
    }
    hits_.take_off(some, bound);
  }

  // Hits of the order, from `first`; none where there are 0 or fewer.
  GART_KERNEL GART_INLINE void give(int first, int count) {
    each_in_group([&](int l) {
      if (l >= count) return;
      hit const h = hits_.at(first + l);
      m_.ready.put(l, h);
      if constexpr (takes_together<P> && shows_hits<P>) m_.shown[l] = program_.shade(state_, h.id);
    });
    group_barrier();
    bool goes_on = true;
    if constexpr (takes_together<P>) {
      group_values<typename P::taken_hit> all;
      int taken = 0;
      while (goes_on && taken < count) {
        typename P::taken_hit one;
        if constexpr (shows_hits<P>)
          goes_on = program_.take(state_, m_.ready.at(taken), m_.shown[taken], one);
        else
          goes_on = program_.take(state_, m_.ready.at(taken), one);
        give_lane(all, taken++, one);
      }
      program_.keep_together(state_, static_cast<u32>(taken), all);
    } else {
      group_values<bool> more;
      each_in_group([&](int l) {
        more[l] = true;
        if (l != 0) return;
        for (int k = 0; k < count && more[l]; ++k) more[l] = program_.on_hit(state_, m_.ready.at(k));
      });
      goes_on = of_lane(more, 0);
    }
    if (count > 0) last_t_ = m_.ready.t[count - 1], last_id_ = m_.ready.id[count - 1], passed_ = true;
    alive_ = alive_ && goes_on;
    group_barrier();
  }

  GART_KERNEL void trace_alone(bool stuck) {
    group_barrier();
    each_in_group([&](int l) {
      if (l != 0 || !stuck) return;
      lone_ray<Response, ray_type, group_memory::hit_room, 1> ray{scene_,          own_, last_t_, last_id_, end_,
                                                                  m_.hits.waiting, 0};
      ray.trace(index_, program_, state_);
    });
    group_barrier();
  }

  Index const& index_;
  traced_scene const& scene_;
  P const& program_;
  group_memory& m_;
  state_type& state_;  // on a device each lane has its own, which are the same, or lane 0's alone counts
  ray_type own_;
  slab_ray slab_;
  float last_t_;  // the last hit passed on
  u32 last_id_ = 0xffffffffu;
  float end_;  // of the ray
  hits_type hits_;
  group_values<u32> first_word_, final_word_;  // of a node's sides: those a lane reads where the ray enters and leaves
  int places_ = 0, candidates_ = 0;
  u32 unmet_ = 0, newest_ = 0;  // the nearest entry of a node that candidates are of; that of the last such node
  bool passed_ = false;         // a hit, in this walk
  bool alive_;
};

// The rays of a launch that are no beams, eight lanes each.
template <class Response, class Index, ray_program P>
struct walk_groups {
  static constexpr int block_size = 64, min_blocks = 10, rays_at_once = block_size / group_lanes;

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
  // Groups without a ray come along.
  GART_KERNEL GART_INLINE void trace(group_memory& memory, index_t at) const {
    bool wanted = at < rays && (!apart || apart[at / beam_lanes]);
    if (!in_any_group(wanted)) return;
    index_t const i = wanted ? (order ? order[at] : at) : 0;
    wanted = wanted && program.active(i);
    auto state = program.begin(i);
    grouped_ray<Response, Index, P>(index, scene, program, memory, i, wanted, state).trace();
    each_in_group([&](int l) {
      if (l == 0 && wanted) program.end(i, state);
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
