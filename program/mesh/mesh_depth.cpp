#include "mesh_depth.hpp"

#include <gart/exec/parallel.hpp>
#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace gart_cli {

namespace {

using gart::index_t;

template <gart::rays_of_pixels Rays>
struct median_depth : gart::ray_program_base {
  using ray_type = typename Rays::ray_type;
  struct state {
    gart::pixel at;
    ray_type ray;
    float transmittance = 1, t = 0;
  };
  Rays rays;
  gart::pixel_order order;
  gart::vec3d position;
  met_ray* out;

  bool active(index_t i) const { return order.inside(order.at(i)); }
  state begin(index_t i) const { return {order.at(i), pixel_ray(rays, order.at(i))}; }
  ray_type ray_of(index_t, state const& s) const { return s.ray; }
  bool on_hit(state& s, gart::hit const& h) const {
    s.transmittance *= 1 - h.alpha;
    if (s.transmittance >= 0.5f) return true;
    s.t = h.t;
    return false;
  }
  void end(index_t, state const& s) const {
    out[order.address(s.at)] = {position + gart::vec3d(origin_of(s.ray)), s.ray.direction, s.t};
  }
};

}  // namespace

struct median_depths::scene {
  gart::openmp_exec exec;
  gart::gaussians<gart::openmp_exec> gaussians{exec, 0, 0};
  gart::render_options options;
  gart::frame<gart::openmp_exec, gart::scene_traits<0>, gart::bvh_tracer<gart::openmp_exec>> frame{exec};
};

median_depths::median_depths(gart::gaussian_model model, gart::render_options const& options)
    : scene_(std::make_unique<scene>()) {
  scene_->options = options;
  scene_->gaussians.assign(gart::with_sh_degree(std::move(model), 0));
}

median_depths::~median_depths() = default;

std::vector<met_ray> median_depths::of(gart::camera const& view) {
  std::vector<met_ray> out(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  auto& frame = scene_->frame;
  frame.prepare(std::as_const(scene_->gaussians).view(), view, scene_->options);
  gart::pixel_order const order{view.width, view.height};
  frame.with_rays([&]<class Rays>(Rays const& rays) {
    frame.trace("median depth", order.launch_size(),
                median_depth<Rays>{{}, rays, order, frame.view().position, out.data()});
  });
  return out;
}

}  // namespace gart_cli
