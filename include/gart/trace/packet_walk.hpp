#pragma once
/// \file
/// The walk of tile lists on a host: rays in packets, a lane a pixel (math/lanes.hpp). It does the same as walk_tiles
/// (trace/tile_tracer.hpp), hit by hit and bit by bit. A candidate is evaluated for all rays of a packet at once, and
/// its hits stay together. They wait in a list of groups, each one Gaussian's hits with some of the rays. The list's
/// order sorts the hits of each ray by (t, id). Where rays meet two Gaussians in opposite orders, no one place suits
/// all hits of a candidate. The candidate then takes two groups.
///
/// A packet may have more hits waiting than there are groups for. It says so, and its rays are traced one by one.

#include <gart/camera/ray_depth.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/packet_program.hpp>
#include <gart/trace/tracer.hpp>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// A packet keeps 32 times the hits of a ray traced alone, in groups. Packets that run over are traced again from the
/// start, not resumed.
template <class Response, int Size, packet_program P>
class packet_walk {
 public:
  static_assert(Size % packet_block::width == 0 && Size % packet_block::height == 0 &&
                Size <= packet_cell::largest_tile);

  /// To be called before the first packet of a tile, whose pixels are `area`.
  void enter(pixel_box const& area) { area_ = area, loaded_ = ~u32{0}; }

  /// False where more hits waited than there is room for; nothing then counts.
  bool operator()(P const& program, traced_scene const& scene, tile_map_view const& map, footprint_slots const* ranges,
                  ray_depth const& depth, u32 tile, packet_block block) {
    auto state = program.begin(block);
    vec3_of<lanes> const& d = state.directions;
    lanes const depth_of_t = depth.per_distance(d);
    alive_ = state.inside, farthest_ = 0.0f, count_ = used_ = 0, free_ = sentinel;
    pool_[sentinel].nearer = pool_[sentinel].farther = sentinel;
    int const x = block.x % Size, y = block.y % Size;
    u32 const end = map.offsets[tile + 1];
    for (u32 first = map.offsets[tile]; first < end && any(alive_); first += chunk) {
      int const cells = load(scene, map, ranges, first, end);
      for (int k = 0; k < cells;) {
        float const bound = map.depth(first + static_cast<u32>(k));
        int n = 0;
        for (; k < cells && n < batch; ++k) {
          near_[n] = static_cast<u16>(k);
          n += cells_[k].bits_inside(x, y) ? 1 : 0;
        }
        if (count_ >= pass_threshold) {
          pass_on(program, state, depth_of_t, bound);
          if (!any(alive_)) break;
        }
        if (!take(program, scene, state, d, n)) return false;
      }
    }
    pass_on(program, state, depth_of_t, no_bound);
    program.end(state);
    return true;
  }

 private:
  static constexpr int most_groups = 32 * 32;
  static constexpr int split_threshold = most_groups / 2;  // of groups, from which one may be passed on in parts
  static constexpr int pass_threshold = 12;    // of groups, below which looking for certain hits does not pay
  static constexpr int batch = 16;             // candidates between two such looks
  static constexpr u32 chunk = 256;            // candidates of a tile whose cells are kept at a time
  static constexpr u32 prefetch_distance = 6;  // in candidates
  static constexpr int shaded_at_once = 4;     // groups
  static constexpr float no_bound = -1;        // the list is at its end

  static constexpr u16 sentinel = most_groups;  // the group before the first and behind the last

  struct hits {
    lanes t, alpha;
    lane_mask rays;
    u32 id;
    typename P::note note;
  };
  struct group : hits {
    u16 nearer, farther;  // its neighbours
  };

  // The tile's candidates from `first` on, once for all packets of a tile that has no more of them.
  int load(traced_scene const& scene, tile_map_view const& map, footprint_slots const* ranges, u32 first, u32 end) {
    u32 const n = end - first < chunk ? end - first : chunk;
    if (loaded_ == first) return static_cast<int>(n);
    u32 const* const list = map.primitives.data() + first;
    for (u32 k = 0; k < n; ++k) {
      if (k + prefetch_distance < n) prefetch(&ranges[list[k + prefetch_distance]]);
      prefetch(&scene.gaussians[list[k]]);
      cells_[k] = typename P::cell(list[k], ranges[list[k]], area_);
    }
    loaded_ = first;
    return static_cast<int>(n);
  }

  // The hits of the batch's n candidates. All are evaluated before the first is put in its place. The next evaluation
  // hides the latency of this one. The place of a hit is a branch that is predicted badly.
  template <class State>
  GART_INLINE bool take(P const& program, traced_scene const& scene, State const& state, vec3_of<lanes> const& d,
                        int n) {
    int count = 0;
    for (int i = 0; i < n; ++i) {
      typename P::cell const& cell = cells_[near_[i]];
      ray_gaussian const& g = scene.gaussians[cell.id];
      ray_peak_of<lanes> const r = evaluate(g, primary_ray_of<lanes>{d});
      hits& h = found_[count];  // alpha: |p|^2 for now
      h.t = r.t, h.alpha = r.d2, h.rays = alive_ & is_hit(g, r, scene.near), h.id = cell.id;
      h.note = program.expect(state, cell);
      count += any(h.rays) ? 1 : 0;
    }
    for (int i = 0; i < count; ++i) {
      hits& h = found_[i];
      h.alpha = hit_alpha<Response>(scene.gaussians[h.id], h.alpha);
    }
    for (int i = 0; i < count; ++i) {
      program.fetch(found_[i].id);
      if (!insert(found_[i])) return false;
    }
    return true;
  }

  // Hits behind all others of their rays stand last; the rest go forward from there. A hit may stand behind the last
  // group that it must follow and before the first that must follow it. Rays that share a gap share a group.
  GART_INLINE bool insert(hits const& h) {
    lane_mask settled = h.rays & (h.t > farthest_), left = h.rays & ~settled;
    farthest_ = select(settled, h.t, farthest_);
    u16 gap = sentinel;  // before this group
    for (u16 at = pool_[sentinel].nearer; any(left) && at != sentinel; at = pool_[at].nearer) {
      group const& other = pool_[at];
      lane_mask const both = left & other.rays;
      // Of two at one t; no branch, for ids are in no order.
      lane_mask const first = lanes_of(h.id < other.id ? ~u32{0} : u32{0});
      lane_mask const nearer = both & ((h.t < other.t) | (first & (h.t == other.t))), farther = both & ~nearer;
      settled |= farther, left &= ~farther;
      if (any(nearer)) {
        if (any(settled) && !put(h, settled, gap)) return false;
        settled = lanes_of(0), gap = at;
      }
    }
    return put(h, settled | left, gap);
  }

  GART_INLINE bool put(hits const& h, lane_mask rays, u16 gap) {
    u16 at = free_;
    if (at != sentinel)
      free_ = pool_[at].farther;
    else if (used_ < most_groups)
      at = used_++;
    else
      return false;
    group& r = pool_[at];
    r.t = h.t, r.alpha = h.alpha, r.rays = rays, r.id = h.id, r.note = h.note;
    r.farther = gap, r.nearer = pool_[gap].nearer;
    pool_[r.nearer].farther = at, pool_[gap].nearer = at;
    ++count_;
    return true;
  }

  // Hits nearer than all that is left of the list go to the program.
  template <class State>
  void pass_on(P const& program, State& state, lanes const& depth_of_t, float bound) {
    lane_mask stay = lanes_of(0);
    u16 last = sentinel, at = pool_[sentinel].farther;  // of those that stay; the next to look at
    for (;;) {
      // A few groups at a time are shaded side by side. The others hide the latency of one colour's sum.
      group const* ready[shaded_at_once];
      lane_mask now[shaded_at_once];
      typename P::shaded shaded[shaded_at_once];
      int n = 0;
      while (n < shaded_at_once && at != sentinel && any(alive_ & ~stay)) {
        group& r = pool_[at];
        lane_mask const rays = r.rays & alive_;
        lane_mask pass = rays;
        if (bound != no_bound) {
          pass &= ~stay & (r.t * depth_of_t < lanes(bound));
          // A group goes as one, unless there is no room for more of them.
          if (any(rays & ~pass) && count_ < split_threshold) pass = lanes_of(0);
        }
        if (any(pass)) ready[n] = &r, now[n++] = pass;
        u16 const next = r.farther;
        r.rays = rays & ~pass;
        stay |= r.rays;
        if (any(r.rays)) {
          last = at;
        } else {
          pool_[last].farther = next, pool_[next].nearer = last;
          r.farther = free_, free_ = at, --count_;
        }
        at = next;
      }
      if (n == 0) break;
      for (int i = 0; i < n; ++i) shaded[i] = program.shade(state, ready[i]->id);
      for (int i = 0; i < n; ++i) {
        group const& r = *ready[i];
        lane_mask const rays = now[i] & alive_;
        if (any(rays)) alive_ &= program.on_hit(state, rays, r.t, r.alpha, shaded[i], r.note) | ~rays;
      }
    }
  }

  lane_mask alive_;
  lanes farthest_;       // of each ray's hits so far
  int count_ = 0;        // groups that wait
  u16 used_ = 0;         // groups taken so far,
  u16 free_ = sentinel;  // and those of them that are free again, linked by `farther`
  group pool_[most_groups + 1];

  pixel_box area_;
  typename P::cell cells_[chunk];  // of the tile's list, from entry loaded_ of the map on
  u32 loaded_;
  u16 near_[batch];  // those of a batch whose boxes the packet overlaps
  hits found_[batch];
};

}}  // namespace gart::GART_ISA

#endif
