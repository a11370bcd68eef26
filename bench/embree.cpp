// A view's rays as a batch by gart's tree, against Embree's packets of 16 on the same rays. Embree has user geometry
// over the same boxes, and the same arithmetic of hits. A ray has a window of 32 hits, and is walked again for more.
// Built by name, where Embree 3 is.
#include "support/frame.hpp"

#include <gart/math/lanes.hpp>
#include <gart/rays/ray_tracer.hpp>
#include <gart/trace/bvh_tracer.hpp>

#include <embree3/rtcore.h>

#include <algorithm>
#include <memory>

namespace {

using response = gart::generalized_gaussian<>;
using program_type = gart::batch_composite<>;
constexpr int packet_rays = 16, window = 32, block = 4;

// Blocks of 4 x 4 pixels one after another, as packets want them; what makes no whole block is left out.
std::vector<float> directions_in_blocks(gart::camera const& view) {
  gart::serial_exec exec;
  gart::camera_rays<gart::serial_exec> rays(exec);
  rays.cast(exec, view);
  std::vector<float> out;
  for (int y = 0; y + block <= view.height; y += block)
    for (int x = 0; x + block <= view.width; x += block)
      for (int l = 0; l < packet_rays; ++l) {
        gart::vec3 const d = gart::pixel_ray(rays.view(), gart::pixel{x + l % block, y + l / block}).direction;
        out.insert(out.end(), {d.x, d.y, d.z});
      }
  return out;
}

template <gart::execution E>
struct batch {
  gart::gaussians<E> scene;
  gart::buffer<float, E> directions, color;
  gart::ray_batch rays;
  gart::ray_tracer<E> tracer;
  gart::render_options options;

  explicit batch(E& exec)
      : scene(exec, gart_bench::the_scene().model),
        directions(exec, directions_in_blocks(gart_bench::the_scene().view())),
        color(exec, directions.size()),
        rays{gart_bench::the_scene().view().position, {}, directions, {}},
        tracer(exec) {
    tracer.set_scene(view(), gart_bench::sh_degree);
    trace();
  }
  gart::gaussians_view<float const> view() const { return std::as_const(scene).view(); }
  void trace() { tracer.trace(rays, options, {.color = color.data()}); }
};

template <gart::execution E>
void by_tree(benchmark::State& state, E& exec) {
  batch<E> b(exec);
  gart_bench::measure(state, exec, [&] { b.trace(); });
  state.counters["rays"] = b.rays.count();
}

// A packet's rays on their way.
struct packet {
  gart::traced_scene scene;
  gart::primary_ray_of<gart::lanes> rays[packet_rays / gart::lane_count];
  float last_t[packet_rays];
  gart::u32 last_id[packet_rays];
  gart::lane_hits<window, packet_rays> memory;
  gart::hits_of_lane<window, packet_rays> waiting[packet_rays];
};
struct query : RTCIntersectContext {
  packet* at;
};

void bound(RTCBoundsFunctionArguments const* a) {
  gart::box const& b = static_cast<gart::box const*>(a->geometryUserPtr)[a->primID];
  *a->bounds_o = {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0};
}

void meet(RTCIntersectFunctionNArguments const* a) {
  packet& p = *static_cast<query*>(a->context)->at;
  gart::u32 const id = a->primID;
  gart::ray_gaussian const& g = p.scene.gaussians[id];
  for (int first = 0; first < packet_rays; first += gart::lane_count) {
    auto const r = gart::evaluate(g, p.rays[first / gart::lane_count]);
    gart::u32 found = gart::bits_of(gart::is_hit(g, r, p.scene.near));
    if (!found) continue;
    gart::lanes const alpha = gart::hit_alpha<response>(g, r.d2);
    for (; found; found &= found - 1) {
      int const lane = __builtin_ctz(found), l = first + lane;
      float const t = r.t.v[lane];
      if (!a->valid[l] || !gart::before(p.last_t[l], p.last_id[l], t, id) || t > p.waiting[l].far(p.memory, l))
        continue;
      p.waiting[l].insert(p.memory, l, {t, id, alpha.v[lane]});
      if (p.waiting[l].full())
        RTCRayN_tfar(RTCRayHitN_RayN(a->rayhit, packet_rays), packet_rays, l) = p.waiting[l].far(p.memory, l);
    }
  }
}

// All hits of 16 rays a team, in order, until the program has enough.
struct trace_packets {
  struct scratch {};
  RTCScene tree;
  gart::traced_scene scene;
  program_type program;

  void operator()(auto const& team) const {
    packet p;
    p.scene = scene;
    alignas(64) RTCRayHit16 r{};
    alignas(64) int valid[packet_rays];
    program_type::state state[packet_rays];
    gart::vec3 direction[packet_rays];
    gart::index_t const first = team.tile() * packet_rays;
    for (int l = 0; l < packet_rays; ++l) {
      gart::index_t const i = first + static_cast<gart::index_t>(l);
      state[l] = program.begin(i), direction[l] = program.ray_of(i, state[l]).direction;
      for (int k = 0; k < 3; ++k) p.rays[l / gart::lane_count].direction[k].v[l % gart::lane_count] = direction[l][k];
      p.last_t[l] = scene.near, p.last_id[l] = ~0u;
    }
    for (gart::u32 alive = (1u << packet_rays) - 1; alive;) {
      for (int l = 0; l < packet_rays; ++l) {
        p.waiting[l].clear(), valid[l] = alive >> l & 1 ? -1 : 0;
        r.ray.dir_x[l] = direction[l].x, r.ray.dir_y[l] = direction[l].y, r.ray.dir_z[l] = direction[l].z;
        r.ray.tnear[l] = p.last_t[l], r.ray.tfar[l] = __builtin_huge_valf(), r.ray.mask[l] = ~0u;
        r.hit.geomID[l] = RTC_INVALID_GEOMETRY_ID;
      }
      query q;
      rtcInitIntersectContext(&q);
      q.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT, q.at = &p;
      rtcIntersect16(valid, tree, &q, &r);
      for (gart::u32 left = alive; left; left &= left - 1) {
        int const l = __builtin_ctz(left);
        bool more = p.waiting[l].full();
        while (p.waiting[l].size() > 0) {
          gart::hit const h = p.waiting[l].pop(p.memory, l);
          p.last_t[l] = h.t, p.last_id[l] = h.id;
          if (program.on_hit(state[l], h)) continue;
          more = false;
          break;
        }
        if (!more) alive &= ~(1u << l);
      }
    }
    for (int l = 0; l < packet_rays; ++l) program.end(first + static_cast<gart::index_t>(l), state[l]);
  }
};

template <gart::execution E>
void by_embree(benchmark::State& state, E& exec) {
  batch<E> b(exec);
  gart::gaussians_view<float const> const scene = b.view();
  gart::buffer<gart::ray_gaussian, E> records(exec, scene.count);
  gart::buffer<gart::box, E> boxes(exec, scene.count);
  gart::parallel_for(
      exec, "records", scene.count,
      gart::render_kernels::prepare_gaussians<response>{scene, b.rays.frame, b.options.alpha_min, records.view()});
  gart::parallel_for(exec, "boxes", scene.count,
                     gart::trace_kernels::bound_ellipsoids<response>{scene, b.rays.frame, b.options.alpha_min, boxes});
  RTCDevice const device = rtcNewDevice(nullptr);
  RTCScene const tree = rtcNewScene(device);
  RTCGeometry const geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetSceneFlags(tree, RTC_SCENE_FLAG_ROBUST);
  rtcSetGeometryUserPrimitiveCount(geometry, scene.count);
  rtcSetGeometryUserData(geometry, boxes.data());
  rtcSetGeometryBoundsFunction(geometry, bound, nullptr);
  rtcSetGeometryIntersectFunction(geometry, meet);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(tree, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(tree);
  gart::buffer<float, E> color(exec, b.color.size());
  trace_packets const trace{tree,
                            {records.data(), scene.count, b.options.near},
                            {{},
                             gart::batch_rays(b.rays),
                             {scene.sh, scene.sh_degree, gart_bench::sh_degree},
                             b.options,
                             {color.data()},
                             {}}};
  gart::index_t const packets = b.rays.count() / packet_rays;
  gart_bench::measure(state, exec, [&] { gart::parallel_for(exec, "packets", gart::tile_range{packets, 1}, trace); });
  state.counters["rays"] = b.rays.count();
  state.counters["same"] = color.to_host() == b.color.to_host();
  rtcReleaseScene(tree), rtcReleaseDevice(device);
}

}  // namespace

GART_BENCH("rays/view/batch", by_tree)
GART_BENCH("rays/view/embree_packets", by_embree)
