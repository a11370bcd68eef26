#pragma once
/// \file
/// The walk of tile lists on a host: rays in packets, a lane a pixel (math/lanes.hpp). It does the same as walk_tiles
/// (trace/tile_tracer.hpp), hit by hit and bit by bit. A candidate is evaluated and shaded for all rays of a packet at
/// once. Its hits wait in rows (trace/packet_rows.hpp): the nearest hits of all rays, the next nearest, and so on. So
/// what is passed on is a hit of every ray at a time, though rays meet their Gaussians in different orders.
///
/// A packet may have more hits waiting than there is room for. It says so, and its rays are traced one by one.

#include <gart/camera/ray_depth.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/packet_program.hpp>
#include <gart/trace/packet_rows.hpp>
#include <gart/trace/tracer.hpp>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// Packets that run over are traced again from the start, not resumed.
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
    alive_ = state.inside;
    rows_.clear();
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
        if (rows_.size() >= pass_threshold) {
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
  static constexpr int pass_threshold = 8;     // of rows, below which looking for certain hits does not pay
  static constexpr int crowd = 64;             // rows, from which few certain hits are passed on too
  static constexpr int batch = 16;             // candidates between two such looks
  static constexpr u32 chunk = 256;            // candidates of a tile whose cells are kept at a time
  static constexpr u32 prefetch_distance = 6;  // in candidates
  static constexpr float no_bound = -1;        // the list is at its end

  using shaded = typename P::shaded;

  struct candidate {
    lanes t, alpha;  // alpha: |p|^2 at first
    lane_mask rays;
    u32 id;
    lane_words places;
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
      candidate& c = found_[count];
      c.t = r.t, c.alpha = r.d2, c.rays = alive_ & is_hit(g, r, scene.near), c.id = cell.id;
      c.places = program.expect(state, cell);
      count += any(c.rays) ? 1 : 0;
    }
    for (int i = 0; i < count; ++i) {
      candidate& c = found_[i];
      program.fetch(c.id);
      c.alpha = hit_alpha<Response>(scene.gaussians[c.id], c.alpha);
    }
    for (int i = 0; i < count; ++i) {
      candidate const& c = found_[i];
      if (!rows_.insert(c.t, c.rays, c.id, [&](auto& hits) {
            hits.alpha = c.alpha, hits.places = c.places, hits.shown = program.shade(state, c.id);
          }))
        return false;
    }
    return true;
  }

  // Hits nearer than all that is left of the list go to the program, a hit of each ray at a time. A step costs the same
  // for one ray as for all. So few of those that have hits wait for the others, while there is room.
  template <class State>
  void pass_on(P const& program, State& state, lanes const& depth_of_t, float bound) {
    while (rows_.size() > 0) {
      lanes const t = rows_.nearest();
      lane_mask now = rows_.filled();
      if (bound != no_bound) {
        int const waiting = __builtin_popcount(bits_of(now));
        now &= t * depth_of_t < lanes(bound);
        int const ready = __builtin_popcount(bits_of(now));
        if (ready == 0 || (4 * ready < 3 * waiting && rows_.size() < crowd)) return;
      }
      waiting_hits<shaded> const h = rows_.nearest_hits(now);
      lane_mask const ended = now & ~program.on_hit(state, now, t, h.alpha, h.shown, h.places);
      rows_.pop(now);
      if (any(ended)) alive_ &= ~ended, rows_.empty(ended);
    }
  }

  lane_mask alive_;
  packet_rows<shaded> rows_;

  pixel_box area_;
  typename P::cell cells_[chunk];  // of the tile's list, from entry loaded_ of the map on
  u32 loaded_;
  u16 near_[batch];  // those of a batch whose boxes the packet overlaps
  candidate found_[batch];
};

}}  // namespace gart::GART_ISA

#endif
