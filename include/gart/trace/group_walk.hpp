#pragma once
/// \file
/// The walk of a tree by single rays that are few. Eight lanes take a ray (trace/lane_group.hpp), and a warp takes four
/// rays, step by step together. One lane a ray would leave a device waiting for the longest of them. A lane tests a
/// child, evaluates a candidate, or looks up what a hit shows. Nodes are visited once, the nearest first. Two are
/// opened at a time, so that their memory is waited for together. Hits wait until they lie before all that is left.
///
/// Memory a ray: 16 nodes a lane, 48 hits. The farthest of either are dropped where there is no room. Hits before them
/// are still passed on, and the ray walks again, strictly after its last. Where that brings no hit, one lane goes on as
/// walk_alone does.

#include <gart/trace/beam_walk.hpp>
#include <gart/trace/group_nodes.hpp>

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
  static constexpr int at_once = 2;  // nodes that are opened together
  static constexpr int node_room = 16, candidate_room = 64, hit_room = 48;
  static_assert(candidate_room >= (at_once + 1) * group_lanes);
  group_nodes_memory<node_room> nodes;
  u32 candidate[candidate_room];  // a ring
  group_hits_memory<hit_room> hits;
  lane_hits<group_lanes, 1> ready;  // to be passed on, in order
  vec3 shown[group_lanes];          // by those
  u32 apart[28];
};
static_assert(sizeof(group_memory) % 128 == 32);

template <class Response, class Index, ray_program P>
class grouped_ray {
  using state_type = typename P::state;
  using ray_type = typename P::ray_type;
  using hits_type = group_hits<group_memory::hit_room>;
  static constexpr u32 gone = hits_type::gone;
  static constexpr int at_once = group_memory::at_once;
  using nodes_type = group_nodes<group_memory::node_room, at_once>;
  static constexpr int pass_from = 16;              // hits, from which it is asked which are certain
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
        nodes_(memory.nodes),
        alive_(wanted && index.tree.count > 0) {
    each_in_group([&](int l) {
      u32 const k = static_cast<u32>(l) / side_words % 3, word = side_words * k + static_cast<u32>(l) % side_words;
      bool const backwards = slab_.inverse[static_cast<int>(k)] < 0;
      first_word_[l] = word + (backwards ? 3 * side_words : 0),
      final_word_[l] = word + (backwards ? 0 : 3 * side_words);
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
    hits_.clear(), nodes_.start(alive_);
    passed_ = false, candidates_ = first_candidate_ = turn_ = 0;
    float const near = last_t_;
    bool walks = alive_;
    while (in_any_group(walks)) {
      while (nodes_.any_full()) lose_nodes();
      u32 const nearest = nodes_.nearest();
      bool const done = nearest > reach();  // or there is none
      while (in_any_group(candidates_ >= group_lanes || (done && candidates_ > 0))) evaluate();
      bool const ends = walks && done && candidates_ == 0;
      u32 const bound = ends ? gone : candidates_ > 0 && unmet_ < nearest ? unmet_ : nearest;
      bool const some = hits_.may_pass(bound);
      if (in_any_group(some && (ends || hits_.size() >= pass_from))) pass_on(some, bound);
      walks = walks && alive_ && !ends;
      if (!walks) candidates_ = 0, hits_.drop(), nodes_.drop();
      bool const goes_on = walks && !done;
      if (in_any_group(goes_on)) expand(goes_on, nearest, near);
    }
  }

  GART_HD GART_INLINE void lose_nodes() {
    u32 const key = nodes_.lose_farthest();
    if (key != gone) hits_.lose(u64{key} << 32);
  }

  // Nothing beyond is wanted.
  GART_HD GART_INLINE u32 reach() const {
    u32 const end = float_to_bits(end_), lost = static_cast<u32>(hits_.lost() >> 32);
    return end < lost ? end : lost < gone ? lost : gone - 1;
  }

  // The nearest nodes give way to their children. `key`: where the nearest of all is entered.
  GART_HD GART_INLINE void expand(bool goes_on, u32 key, float near) {
    u32 nodes[at_once];
    bool opens[at_once];
    nodes_.take(goes_on, key, reach(), nodes, opens);
    // A lane reads a word of each side for all lanes.
    group_values<u32> first[at_once], final[at_once], child[at_once];
    turn_ = (turn_ + 3) % bvh_width;
    GART_UNROLL
    for (int i = 0; i < at_once; ++i)
      each_in_group([&](int l) {
        bvh_node const& n = index_.tree.nodes[nodes[i]];
        u32 const* const words = &n.plane[0][0][0];
        first[i][l] = words[first_word_[l]], final[i][l] = words[final_word_[l]], child[i][l] = n.child[child_of(i, l)];
      });
    GART_UNROLL
    for (int i = 0; i < at_once; ++i) {
      auto const& head = load_grid(index_.tree.nodes[nodes[i]]);
      grid_crossing const grid(head, slab_);
      group_values<bool> is_candidate;
      each_in_group([&](int l) {
        int const c = child_of(i, l);
        u32 side[2][3];
        GART_UNROLL
        for (int k = 0; k < 3; ++k) {
          int const from = side_words * k + c / 4;
          side[0][k] = of_lane(first[i], from), side[1][k] = of_lane(final[i], from);
        }
        float from;
        bool const crossed = cross_child(grid, c, side[0], side[1], near, end_, from) && opens[i];
        is_candidate[l] = crossed && (head.leaf_mask() >> c & 1u);
        if (crossed && (head.inner_mask() >> c & 1u)) nodes_.put(l, from > 0 ? float_to_bits(from) : 0, child[i][l]);
      });
      u32 const leaves = group_where([&](int l) { return is_candidate[l]; });
      each_in_group([&](int l) {
        if (is_candidate[l])
          m_.candidate[candidate_place(candidates_ + count_bits(bits_before(leaves, l)))] = child[i][l];
      });
      if (leaves) newest_ = key, unmet_ = candidates_ == 0 || key < unmet_ ? key : unmet_;
      candidates_ += count_bits(leaves);
    }
    group_barrier();
  }
  GART_HD GART_INLINE int candidate_place(int k) const { return (first_candidate_ + k) % group_memory::candidate_room; }
  // The child of node i that a lane tests: not always the same one, so that nodes spread over the lanes.
  GART_HD GART_INLINE int child_of(int i, int lane) const { return (lane + turn_ + 5 * i) % bvh_width; }

  // A lane a candidate, those that were found first.
  GART_HD GART_INLINE void evaluate() {
    group_values<hit> found;
    group_values<bool> is_new;
    each_in_group([&](int l) {
      is_new[l] = l < candidates_;
      if (!is_new[l]) return;
      u32 const id = m_.candidate[candidate_place(l)];
      ray_gaussian const g = scene_.gaussians[id];
      ray_peak const r = gart::evaluate(g, own_);
      is_new[l] = is_hit(g, r, scene_.near) && before(last_t_, last_id_, r.t, id) && r.t <= end_;
      if (is_new[l]) found[l] = {r.t, id, hit_alpha<Response>(g, r.d2)};
    });
    hits_.add(candidates_ > 0, found, is_new);
    int const met = candidates_ < group_lanes ? candidates_ : group_lanes;
    candidates_ -= met, first_candidate_ = candidate_place(met);
    // What is left is of the nodes that were opened last.
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
  nodes_type nodes_;
  int candidates_ = 0, first_candidate_ = 0;   // in the ring
  int turn_ = 0;                               // of the lanes among a node's children
  group_values<u32> first_word_, final_word_;  // of a node's sides: what a lane reads, where the ray enters and leaves
  u32 unmet_ = 0, newest_ = 0;  // the nearest entry of a node that candidates are of; that of those opened last
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
