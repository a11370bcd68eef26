#pragma once
// The rays of a view's pixels as a batch, and what a tracer of images makes of them.

#include <gart/rays/ray_tracer.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>

#include <support/policies.hpp>

#include <random>
#include <utility>
#include <vector>

namespace gart_test {

// One index a pixel.
template <class Rays>
struct copy_rays {
  Rays rays;
  int width;
  float *origins, *directions;
  GART_KERNEL void operator()(gart::index_t i) const {
    auto const r = rays.of(static_cast<int>(i) % width, static_cast<int>(i) / width);
    gart::vec3 const o = gart::origin_of(r);
    for (int k = 0; k < 3; ++k)
      origins[3 * i + static_cast<gart::index_t>(k)] = o[k],
                      directions[3 * i + static_cast<gart::index_t>(k)] = r.direction[k];
  }
};

// What was traced of a view, in host memory.
struct view_picture {
  std::vector<float> color, transmittance, depth;
  std::vector<gart::u32> hits;
  std::vector<float> origins, directions;  // of the pixels' rays
};

template <template <class...> class Tracer, class E>
struct tracer_of {
  using type = Tracer<E>;
};

template <class Tracer, class E>
view_picture trace_view(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                        gart::render_options const& options, int active_degree) {
  gart::gaussians<E> const scene(exec, gart::with_sh_degree(model, 3));
  gart::frame<E, gart::scene_traits<3>, Tracer> frame(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> origins(exec, 3 * pixels), directions(exec, 3 * pixels);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  frame.prepare(scene.view(), view, options, active_degree);
  frame.render({color.data(), transmittance.data(), depth.data(), hits.data()});
  frame.with_rays([&]<class Rays>(Rays const& rays) {
    parallel_for(exec, "copy", static_cast<gart::index_t>(pixels),
                 copy_rays<Rays>{rays, view.width, origins.data(), directions.data()});
  });
  return {color.to_host(), transmittance.to_host(), depth.to_host(),
          hits.to_host(),  origins.to_host(),       directions.to_host()};
}

// A batch in memory of the policy.
template <class E>
struct batch_memory {
  batch_memory(E& exec, gart::vec3d const& at, std::vector<float> const& o, std::vector<float> const& d,
               std::vector<float> const& end = {})
      : frame(at), origins(exec, o), directions(exec, d), t_max(exec, end) {}
  gart::ray_batch rays() const { return {frame, origins, directions, t_max}; }
  gart::vec3d frame;
  gart::buffer<float, E> origins, directions, t_max;
};

// All targets of R rays.
template <class E>
struct target_memory {
  target_memory(E& exec, std::size_t n)
      : color(exec, 3 * n),
        transmittance(exec, n),
        depth(exec, n),
        median(exec, n),
        first(exec, n),
        hits(exec, n),
        first_id(exec, n),
        median_id(exec, n),
        top_id(exec, n) {}
  gart::batch_targets targets() const {
    return {color.data(), transmittance.data(), depth.data(),     median.data(), first.data(),
            hits.data(),  first_id.data(),      median_id.data(), top_id.data()};
  }
  gart::traced_rays to_host() const {
    return {color.to_host(), transmittance.to_host(), depth.to_host(),     median.to_host(), first.to_host(),
            hits.to_host(),  first_id.to_host(),      median_id.to_host(), top_id.to_host()};
  }
  gart::buffer<float, E> color, transmittance, depth, median, first;
  gart::buffer<gart::u32, E> hits, first_id, median_id, top_id;
};

template <class E>
gart::traced_rays trace_all(E& exec, gart::ray_tracer<E>& tracer, gart::ray_batch const& rays,
                            gart::render_options const& options) {
  target_memory<E> out(exec, rays.count());
  tracer.trace(rays, options, out.targets());
  return out.to_host();
}

inline bool same(gart::traced_rays const& a, gart::traced_rays const& b) {
  return a.color == b.color && a.transmittance == b.transmittance && a.depth == b.depth && a.median == b.median &&
         a.first == b.first && a.hits == b.hits && a.first_id == b.first_id && a.median_id == b.median_id &&
         a.top_id == b.top_id;
}

// Overlapping Gaussians of many sizes about the origin, some of them thin.
inline gart::gaussian_model cloud(std::uint64_t seed, int sh_degree, std::size_t count) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(count, sh_degree);
  for (auto& x : m.mean) x = normal(engine);
  for (auto& x : m.log_scale) x = -2.0f + 0.8f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = 1.5f * normal(engine);
  for (auto& x : m.sh) x = 0.5f * normal(engine);
  return m;
}

// One of each model.
inline std::vector<std::pair<char const*, gart::camera>> cameras() {
  std::vector<std::pair<char const*, gart::camera>> all;
  gart::camera c;
  c.width = 37, c.height = 26, c.fx = 31, c.fy = 29, c.cx = 18.2f, c.cy = 12.6f;
  c.rotation = gart::mat3(0.36f, 0.48f, -0.8f, -0.8f, 0.6f, 0, 0.48f, 0.64f, 0.6f);
  c.position = gart::vec3d(-1.44, -1.92, -1.8);
  all.emplace_back("pinhole", c);
  c.lens.k1 = -0.1f, c.lens.p1 = 0.003f;
  all.emplace_back("OPENCV", c);
  c.lens = {}, c.kind = gart::camera_kind::fisheye, c.fx = c.fy = 14;
  all.emplace_back("fisheye", c);
  c.kind = gart::camera_kind::equirectangular, c.position = gart::vec3d(0.1, 0, -0.2);
  all.emplace_back("equirectangular", c);
  c = all[0].second;
  c.kind = gart::camera_kind::orthographic, c.fx = c.fy = 9;
  all.emplace_back("orthographic", c);
  c = all[0].second;
  c.shutter = gart::shutter_kind::top_to_bottom, c.travel = gart::vec3(0.2f, 0.1f, -0.3f), c.turn.y = 0.1f;
  all.emplace_back("rolling shutter", c);
  return all;
}

// R rays from anywhere near the cloud to anywhere.
struct random_rays {
  std::vector<float> origins, directions;
  random_rays(std::uint64_t seed, std::size_t count, float spread) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<float> normal;
    for (std::size_t i = 0; i < count; ++i) {
      float d[3], length = 0;
      for (float& x : d) x = normal(engine), length += x * x;
      for (float const x : d) {
        origins.push_back(spread * normal(engine));
        directions.push_back(x / std::sqrt(length));
      }
    }
  }
};

}  // namespace gart_test
