#pragma once
/// \file
/// The walk of a tree by 32 close rays as one beam (bvh/beam.hpp). It is one source on every policy. On a device a beam
/// is a warp. A node is visited once for all rays, in the order of its entry, the four nearest at a time. Each ray
/// evaluates the leaves' candidates by itself. A ray's hits wait in a short queue (trace/lane_hits.hpp). They are
/// passed on once they lie before all nodes that are left. So no ray walks again for more hits than a window holds.
///
/// Memory a beam: 24 hits a ray, 224 nodes. A ray that loses hits walks again, strictly after its last, with the others
/// that did. Where nodes run out of room the walk goes on depth first. If that does not help, rays are traced one by
/// one from where they are. That takes a tree of a depth that no scene has. Rays that go apart make no beam. They are
/// taken one by one by walk_alone, a window of the nearest hits each. It walks again for more.

#include <gart/trace/beam_meet.hpp>
#include <gart/trace/beam_nodes.hpp>
#include <gart/trace/beam_rays.hpp>

#include <new>

namespace gart { inline namespace GART_ISA {

/// A tree in the frame of its rays. What walks are given has these two members besides the tree.
struct frame_index {
  bvh_view tree;  ///< over the boxes
  ///@{
  /// A ray as boxes are tested against it.
  template <class Ray>
  GART_HD placed_ray place(Ray const& r) const {
    return gart::place(r);
  }
  template <class Ray>
  GART_HD slab_ray slab_of(Ray const& r) const {
    return slab_ray(r);
  }
  ///@}
};

namespace trace_kernels {

// One ray's walk: a window of its next hits in memory that lanes share, walked again for more.
template <class Response, class Ray, int Capacity, int Lanes>
struct lone_ray {
  traced_scene scene;
  Ray own;
  float last_t;  // the last hit passed on
  u32 last_id;
  float end;
  lane_hits<Capacity, Lanes>& memory;
  int lane;
  hits_of_lane<Capacity, Lanes> window{};

  GART_HD GART_INLINE float near() const { return last_t; }
  GART_HD GART_INLINE float far() const { return smaller(window.far(memory, lane), end); }
  GART_HD GART_INLINE void leaf(u32 id) {
    ray_gaussian const g = scene.gaussians[id];
    ray_peak const r = evaluate(g, own);
    if (is_hit(g, r, scene.near) && before(last_t, last_id, r.t, id) && r.t <= window.far(memory, lane))
      window.insert(memory, lane, {r.t, id, hit_alpha<Response>(g, r.d2)});
  }

  GART_KERNEL GART_INLINE void trace(auto const& index, auto const& program, auto& state) {
    for (bool more = true; more;) {
      window.clear();
      walk(index.tree, index.slab_of(own), *this);
      more = window.full();
      while (window.size() > 0) {
        hit const h = window.pop(memory, lane);
        last_t = h.t, last_id = h.id;
        if (!program.on_hit(state, h)) return;
      }
    }
  }
};

template <class Response, class Index, ray_program P>
class walk_beams {
 public:
  static constexpr int block_size = beam_lanes, min_blocks = 16;

  Index index;
  traced_scene scene;
  P program;
  index_t rays;      // of the launch
  u32 const* order;  // [rays], a permutation of them: beams are made of neighbours in it; null: as they are
  u32* apart;        // [beams]: whether its rays are left to walk_alone
  float widest;      // of a beam
  int most;          // candidates of a beam: with more of them its rays go on one by one

 private:
  static constexpr int waiting = 24;    // hits of a ray
  static constexpr int pass_from = 12;  // of them, from which it is asked which are certain
  static constexpr int batch = 16;      // candidates read at once
  static constexpr float unbounded = __builtin_huge_valf();

  using ray_type = typename P::ray_type;

  using lane = beam_ray<ray_type, waiting>;
  using lane_of = per_lane<lane>;
  using state_of = per_lane<typename P::state>;

 public:
  struct scratch {
    ray_gaussian staged[batch];
    u32 candidates[batch + beam_lanes];
    beam_nodes nodes;
    beam bounds;
    lane_hits<waiting> hits;
  };

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    lane_of own;
    state_of state;
    each_lane([&](int l) {
      lane& my = own[l];
      index_t const at = team.tile() * beam_lanes + static_cast<index_t>(l);
      my.number = at < rays ? (order ? order[at] : at) : 0;
      my.alive = my.active = at < rays && program.active(my.number);
      my.own = {}, my.last_t = scene.near, my.last_id = 0xffffffffu;
      if (!my.active) return;
      new (&state[l]) typename P::state(program.begin(my.number));
      my.own = program.ray_of(my.number, state[l]);
      my.last_t = start_of_ray(scene, program, my.number);
      my.end = end_of_ray(program, my.number);
    });
    if (!lanes_where([&](int l) { return own[l].active; })) return leave_apart(team.tile(), false);
    if (index.tree.count > 0) {
      made_beam const made = beam_of(
          index.tree, [&](int l) { return own[l].active; }, [&](int l) { return index.place(own[l].own); }, widest);
      if (!made.narrow) return leave_apart(team.tile(), true);
      each_lane([&](int l) {
        if (l == 0) s.bounds = made.bounds;
      });
      int left = most;
      while (walk(team, s, own, state, left)) {
      }
    }
    leave_apart(team.tile(), false);
    each_lane([&](int l) {
      if (own[l].active) program.end(own[l].number, state[l]);
    });
  }

 private:
  GART_HD GART_INLINE void leave_apart(index_t tile, bool go_alone) const {
    each_lane([&](int l) {
      if (l == 0) apart[tile] = go_alone;
    });
  }

  // Once through the tree. Whether to walk it again, for hits that were lost.
  GART_KERNEL GART_INLINE bool walk(auto const& team, scratch& s, lane_of& own, state_of& state, int& left) const {
    float const from = least_of_lanes([&](int l) { return own[l].alive ? own[l].last_t : infinity; });
    each_lane([&](int l) { own[l].hits.clear(); });
    beam_node_queue queue;
    queue.start(team, s.nodes);
    float const near = s.bounds.depth_of(from);
    float reach = reach_of(own);
    int candidates = 0;
    for (;;) {
      int const taken = queue.take(team, s.nodes, reach);
      if (taken == queue.no_room) return trace_apart(s, own, state);
      if (taken > 0) expand(team, s, taken, near, queue, candidates);
      bool const last = queue.nodes == 0;
      if (candidates < batch && !last) continue;
      evaluate(team, s, own, candidates);
      left -= candidates, candidates = 0;
      if (left < 0 && !last) return trace_apart(s, own, state);
      if (!last && !lanes_where([&](int l) { return own[l].alive && own[l].hits.size() >= pass_from; })) continue;
      pass_on(s, own, state, last ? unbounded : bits_to_float(queue.least_key(s.nodes)));
      if (last || !lanes_where([&](int l) { return own[l].alive; })) break;
      reach = reach_of(own);
    }
    each_lane([&](int l) { own[l].alive = own[l].alive && own[l].hits.lost(); });
    return lanes_where([&](int l) { return own[l].alive; }) != 0;
  }

  // No ray has a use for nodes beyond this distance.
  GART_HD GART_INLINE float reach_of(lane_of& own) const {
    return greatest_of_lanes(
        [&](int l) { return own[l].alive ? smaller(own[l].hits.lost_t(), own[l].end) : -infinity; });
  }

  // The children of the nodes that were taken: eight lanes a node, a lane a child.
  template <class Team>
  GART_HD GART_INLINE void expand(Team const& team, scratch& s, int taken, float near, beam_node_queue& queue,
                                  int& candidates) const {
#if defined(__CUDA_ARCH__)
    float entry = 0;
    u32 child = 0;
    int const lane = static_cast<int>(threadIdx.x), c = lane % bvh_width;
    bool is_inner = false, is_leaf = false;
    if (lane / bvh_width < taken) {
      bvh_node const& n = index.tree.nodes[s.nodes.taken[lane / bvh_width]];
      is_inner = c < n.inner_count(), is_leaf = c >= bvh_width - n.leaf_count();
      bool const crossed = crosses_child(n, c, s.bounds, near, entry);
      is_inner = is_inner && crossed, is_leaf = is_leaf && crossed;
      child = n.child[c];
    }
    u32 const inner = __ballot_sync(0xffffffffu, is_inner), leaves = __ballot_sync(0xffffffffu, is_leaf);
    if (is_inner) {
      int const to = queue.places + count_bits(bits_before(inner, lane));
      s.nodes.key[to] = float_to_bits(entry), s.nodes.node[to] = child;
    }
    if (is_leaf) s.candidates[candidates + count_bits(bits_before(leaves, lane))] = child;
    queue.add(count_bits(inner)), candidates += count_bits(leaves);
#else
    for (int k = 0; k < taken; ++k) {
      bvh_node const& n = index.tree.nodes[s.nodes.taken[k]];
      float entry[bvh_width];
      u32 const crossed = cross_children(n, s.bounds, near, entry);
      for (u32 inner = crossed & n.inner_mask(); inner; inner &= inner - 1, queue.add(1)) {
        int const c = lowest_bit(inner);
        s.nodes.key[queue.places] = float_to_bits(entry[c]), s.nodes.node[queue.places] = n.child[c];
      }
      for (u32 leaves = crossed & n.leaf_mask(); leaves; leaves &= leaves - 1)
        s.candidates[candidates++] = n.child[lowest_bit(leaves)];
    }
#endif
    team.barrier();
  }

  // Every candidate, for every ray.
  template <class Team>
  GART_HD GART_INLINE void evaluate([[maybe_unused]] Team const& team, scratch& s, lane_of& own, int candidates) const {
#if defined(__CUDA_ARCH__)
    for (int first = 0; first < candidates; first += batch) {
      int const n = candidates - first < batch ? candidates - first : batch;
      stage(s.staged, scene, s.candidates + first, n);
      team.barrier();
      meet_staged<Response>(own[0], s.hits, s.staged, scene, s.candidates + first, n);
      team.barrier();
    }
#else
    meet_candidates<Response>(own, s.hits, scene, s.candidates, candidates);
#endif
  }

  // Hits nearer than `bound`, before which nothing that is left has any.
  GART_KERNEL GART_INLINE void pass_on(scratch& s, lane_of& own, state_of& state, float bound) const {
    each_lane([&](int l) {
      lane& my = own[l];
      while (my.alive && my.hits.ready(s.hits, l, bound)) {
        hit const h = my.hits.pop(s.hits, l);
        my.last_t = h.t, my.last_id = h.id;
        my.alive = program.on_hit(state[l], h);
      }
    });
  }

  // One by one, from where each ray is. Never again a beam.
  GART_KERNEL GART_INLINE bool trace_apart(scratch& s, lane_of& own, state_of& state) const {
    each_lane([&](int l) {
      lane& my = own[l];
      if (!my.alive) return;
      lone_ray<Response, ray_type, waiting, beam_lanes> ray{scene, my.own, my.last_t, my.last_id, my.end, s.hits, l};
      ray.trace(index, program, state[l]);
      my.alive = false;
    });
    return false;
  }
};

// The rays of a launch that are no beams, one by one.
template <class Response, class Index, ray_program P>
struct walk_alone {
#if defined(__CUDACC__)
  static constexpr int block_size = 128, min_blocks = 5, waiting = 24;
#else
  static constexpr int block_size = 1, min_blocks = 1, waiting = 64;  // so many hits that few rays are walked twice
#endif
  Index index;
  traced_scene scene;
  P program;
  index_t rays;
  u32 const* order;  // as walk_beams has it
  u32 const* apart;  // null: all of them

  using scratch = lane_hits<waiting, block_size>;

  GART_KERNEL void operator()(auto const& team) const {
    team.for_each(block_size, [&](index_t l) {
      index_t const at = team.tile() * block_size + l;
      if (at >= rays || (apart && !apart[at / beam_lanes])) return;
      index_t const i = order ? order[at] : at;
      if (!program.active(i)) return;
      auto state = program.begin(i);
      lone_ray<Response, typename P::ray_type, waiting, block_size> ray{scene,
                                                                        program.ray_of(i, state),
                                                                        start_of_ray(scene, program, i),
                                                                        0xffffffffu,
                                                                        end_of_ray(program, i),
                                                                        team.scratch(),
                                                                        static_cast<int>(l)};
      ray.trace(index, program, state);
      program.end(i, state);
    });
  }
};

// All of them.
template <class Response, execution E, class Index, ray_program P>
void trace_alone(E& exec, char const* label, Index const& index, traced_scene const& scene, index_t rays,
                 u32 const* order, u32 const* apart, P const& program) {
  using kernel = walk_alone<Response, Index, P>;
  constexpr index_t lanes = kernel::block_size;
  parallel_for(exec, label, tile_range{rays / lanes + (rays % lanes != 0), lanes},
               kernel{index, scene, program, rays, order, apart});
}

}  // namespace trace_kernels

/// Feeds `program` the hits of rays 0 to `rays`. `order` is a permutation of them; null: their own order. Neighbours in
/// it go through the tree together where they stay close. Rays are close where they differ by no more than `widest`
/// (trace/beam_rays.hpp). `apart`: memory, a word for each beam_lanes of them. alone(apart) traces the others.
template <class Response, execution E, class Index, ray_program P, class Alone>
void trace_beams(E& exec, char const* label, Index const& index, traced_scene const& scene, index_t rays,
                 u32 const* order, buffer<u32, E>& apart, float widest, P const& program, Alone const& alone) {
  // Where a beam is slower than its rays, for all the candidates that most of them miss.
  constexpr int most = E::device ? 2048 : 8192;
  index_t const beams = rays / beam_lanes + (rays % beam_lanes != 0);
  apart.resize(beams);
  parallel_for(
      exec, label, tile_range{beams, static_cast<index_t>(beam_lanes)},
      trace_kernels::walk_beams<Response, Index, P>{index, scene, program, rays, order, apart.data(), widest, most});
  alone(apart.data());
}
/// The same, the others one by one.
template <class Response, execution E, class Index, ray_program P>
void trace_beams(E& exec, char const* label, Index const& index, traced_scene const& scene, index_t rays,
                 u32 const* order, buffer<u32, E>& apart, P const& program) {
  trace_beams<Response>(exec, label, index, scene, rays, order, apart, widest_beam, program, [&](u32 const* others) {
    trace_kernels::trace_alone<Response>(exec, label, index, scene, rays, order, others, program);
  });
}

}}  // namespace gart::GART_ISA
