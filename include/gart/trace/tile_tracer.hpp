#pragma once
/// \file
/// The traverser on tile lists, for the rays of a camera's pixels: no tree. A tile's list holds every Gaussian that any
/// of its pixels can hit. It is sorted by the nearest possible hit of each there (tiles/tile_order.hpp). A pixel walks
/// the list and keeps the hits found in a small window sorted by (t, id). The first of them is next once it lies nearer
/// than all that is left of the list can. When the window overflows it keeps the nearest. The ray resumes strictly
/// after its last hit, from the first candidate whose hit was dropped. So the walk is exact for any number of hits. The
/// hits are those of the other tracers, bit for bit.
///
/// Rays that meet the same Gaussians are walked together where their program can. On a host they go in packets of lanes
/// (trace/packet_walk.hpp). On a device they go in warps (trace/warp_walk.hpp), for tiles of a multiple of 8. Other
/// programs' rays are walked one by one.
///
/// It traces pixel programs (trace/ray_program.hpp). Cost: the footprints and one sort of the (primitive, tile) pairs.
/// Then comes a walk of each tile's list up to where its rays end.

#include <gart/scene/gaussians.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/hit_ring.hpp>
#include <gart/trace/packet_walk.hpp>
#include <gart/trace/tracer.hpp>
#include <gart/trace/warp_walk.hpp>

namespace gart { inline namespace GART_ISA {

namespace trace_kernels {

template <class Response, int Size, pixel_program P>
struct walk_tiles {
  static constexpr int capacity = 32;  ///< hits that a ray keeps at most, a power of two; more are walked again
  static constexpr int block_size = 64, min_blocks = 8;
  /// The number of candidates between two looks at which hits have become certain. The rays of a warp then pass on
  /// several hits at a time together, with less divergence.
  static constexpr u32 stride = 8;
  tile_grid<Size> grid;
  tile_map_view map;
  traced_scene scene;
  ray_depth depth;  ///< that lists are sorted by
  P program;

  GART_KERNEL void operator()(index_t i) const {
    if (!program.active(i)) return;
    auto state = program.begin(i);
    auto const at = program.at(i);
    walk(state, program.ray_of(i, state),
         static_cast<u32>(at.y) / Size * grid.columns() + static_cast<u32>(at.x) / Size);
    program.end(i, state);
  }

 private:
  template <class State, class Ray>
  GART_HD GART_INLINE void walk(State& state, Ray const& ray, u32 tile) const {
    float const depth_of_t = depth.per_distance(ray.direction);
    u32 const end = map.offsets[tile + 1];
    u32 const* const list = map.primitives.data();
    auto const nearer = [list](pending_hit const& a, pending_hit const& b) {
      return a.t < b.t || (a.t == b.t && list[a.place] < list[b.place]);
    };
    float last_t = scene.near;
    u32 last_id = 0xffffffffu;
    hit_ring<capacity> pending;
    auto const pass_on = [&]() {
      pending_hit const h = pending.pop();
      last_t = h.t, last_id = list[h.place];
      return program.on_hit(state, hit{h.t, last_id, h.alpha});
    };
    for (u32 first = map.offsets[tile]; first < end;) {
      // Hits at or behind the limit did not fit; the earliest candidate of them is where the next round begins.
      pending_hit limit{3.402823466e38f, end, 0};
      u32 resume = end;
      u32 next_id = list[first];
      ray_gaussian next = scene.gaussians[next_id];  // read one ahead, to hide the latency
      for (u32 k = first; k < end; ++k) {
        u32 const id = next_id;
        ray_gaussian const g = next;
        next_id = list[k + 1 < end ? k + 1 : k];
        next = scene.gaussians[next_id];
        if ((k - first) % stride == 0) {
          float const bound = map.depth(k);  // of all that is left of the list
          while (!pending.empty() && pending.front().t * depth_of_t < bound)
            if (!pass_on()) return;
          if (resume < end && pending.empty() && limit.t * depth_of_t < bound) break;
        }
        ray_peak const r = evaluate(g, ray);
        if (!is_hit(g, r, scene.near) || !before(last_t, last_id, r.t, id)) continue;
        pending_hit h{r.t, k, 0};
        if (resume < end && !nearer(h, limit)) {
          resume = k < resume ? k : resume;
          continue;
        }
        h.alpha = hit_alpha<Response>(g, r.d2);
        if (pending.insert(h, nearer)) {
          limit = h;
          resume = h.place < resume ? h.place : resume;
        }
      }
      while (!pending.empty())
        if (!pass_on()) return;
      first = resume;
    }
  }
};

#if !defined(__CUDACC__)
/// On a host, for programs with packets: walks a tile's packets one after another. Rays of a packet that runs over are
/// walked one by one.
template <class Response, int Size, pixel_program P>
struct walk_tile_packets {
  using packets = decltype(packets_of(std::declval<P const&>()));
  using scratch = packet_walk<Response, Size, packets>;
  walk_tiles<Response, Size, P> rays;
  footprint_slots const* ranges;

  template <class Team>
  void operator()(Team const& team) const {
    pixel_box const tile = rays.grid.tile(team.tile());
    packets const program = packets_of(rays.program);
    team.scratch().enter(tile);
    for (int y = tile.y0; y < tile.y1; y += packet_block::height)
      for (int x = tile.x0; x < tile.x1; x += packet_block::width)
        if (!team.scratch()(program, rays.scene, rays.map, ranges, rays.depth, team.tile(), {x, y})) one_by_one({x, y});
  }

 private:
  void one_by_one(packet_block const& block) const {
    auto const& order = rays.program.order;
    for (int l = 0; l < lane_count; ++l) {
      pixel const at{block.x + packet_block::column(l), block.y + packet_block::row(l)};
      if (order.inside(at)) rays(order.index(at));
    }
  }
};
#endif

}  // namespace trace_kernels

/// Size: side of a tile, in pixels.
template <execution E, int Size = 8, class Response = generalized_gaussian<>>
class tile_tracer : public tracer_base {
 public:
  using response_type = Response;                 ///< of the Gaussians
  static constexpr char const* name = "tiles";    ///< its name in requests
  static constexpr int tile_size = Size;          ///< side of a tile, in pixels
  static constexpr bool lends_footprints = true;  ///< to the backward pass

  /// Allocates nothing; `exec` must outlive it.
  explicit tile_tracer(E& exec)
      : rays_(exec), footprints_(exec), map_(exec), orders_(exec), next_(exec), spilled_(exec) {
    static_assert(footprint_tracer<tile_tracer, E>);
  }

  /// View: a camera or a camera model.
  template <class View>
  void prepare(E& exec, gaussians_view<float const> scene, span<ray_gaussian const> gaussians, View const& view,
               trace_options const& options) {
    require_camera(view);
    visit_camera(view, [&](auto const& model) {
      grid_ = {model.width, model.height};
      rays_.cast(exec, model);
      depth_ = model.depth();
      footprints_.template measure<Response>(exec, scene, model, options.alpha_min, options.near, options.rows);
      auto const order = orders_.of(exec, model, rays_, footprints_.depths().data(), gaussians.data());
      map_.build(exec, grid_, footprints_, order, orders_.test_of(model, gaussians.data()));
    });
    if constexpr (E::device) map_.rank_tiles(exec);
    scene_ = {gaussians.data(), scene.count, options.near};
  }

  /// Of the view that it was prepared for.
  pixel_rays rays() const { return rays_.view(); }
  /// The same, of a view without one centre.
  origin_rays rays_with_origins() const { return rays_.with_origins(); }

  /// Feeds `program` the hits of its pixels' rays; `label` names the launch in profiles.
  template <pixel_program P>
  void trace(E& exec, char const* label, index_t rays, P const& program) {
    if constexpr (P::has_warps) static_assert(warp_program<P>, "a ray program that says has_warps is a warp_program");
#if defined(__CUDACC__)
    if constexpr (E::device && P::has_warps && Size % 8 == 0) {
      using walk = walk_tile_warps<Response, Size, P>;
      u32 const most = static_cast<u32>(exec.multiprocessors()) * walk::min_blocks;
      u32 const parts = grid_.count() * walk::tile_parts, teams = parts < most ? parts : most;
      next_.resize(1), spilled_.resize(teams * walk::spill_floats);
      next_.zero();
      parallel_for(exec, label, tile_range{teams, walk::block_size},
                   walk{grid_, map_.view(), footprints_.ranges().data(), scene_, depth_, program, next_.data(),
                        spilled_.data()});
      return;
    }
#endif
    trace_kernels::walk_tiles<Response, Size, P> const walk{grid_, map_.view(), scene_, depth_, program};
#if !defined(__CUDACC__)
    if constexpr (!E::device && P::has_packets) {
      parallel_for(exec, label, tile_range{grid_.count(), 1},
                   trace_kernels::walk_tile_packets<Response, Size, P>{walk, footprints_.ranges().data()});
      return;
    }
#endif
    parallel_for(exec, label, rays, walk);
  }

  /// Boxes and slots of the Gaussians in the view.
  gart::footprints<E, Size> const& footprints() const { return footprints_; }
  /// The tiles' lists.
  tile_map_view map() const { return map_.view(); }

 private:
  tile_grid<Size> grid_;
  camera_rays<E> rays_;
  gart::footprints<E, Size> footprints_;
  tile_map<E, Size> map_;
  depth_orders<E, Size> orders_;
  buffer<u32, E> next_;  // of the device's walk (trace/warp_walk.hpp)
  buffer<float, E> spilled_;
  traced_scene scene_;
  ray_depth depth_;
};

}}  // namespace gart::GART_ISA
