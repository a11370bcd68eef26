#pragma once
/// \file
/// The gradient of a function of the image by the rays that it was cast by, a pixel for itself:
///
///   frame.prepare(scene, view, options);
///   frame.render({.color = color});
///   differentiate_rays(frame, color, {.color = color_gradient}, {.direction = by_direction});
///
/// Lenses are learned by it (lens/differentiate_lens.hpp). It also serves cameras with a ray of its own for each pixel.
/// So it does where something in front of the camera bends rays. Every ray is walked once more, as the pixel method
/// does. Its sums stay with the ray; Gaussians get none. Colours turn with the ray's direction, and are in it
/// (math/sh_turn.hpp). Hits are those of the forward pass, for every tracer and camera, and through the pixels' filter.
/// The gradient is of these hits. The gradient does not contain how the filter changes with a ray.
///
/// A direction is a unit, and its gradient stands across it. The step at a hit's threshold has no gradient.
///
/// Cost: a trace of the view; nothing where it is not called. One kernel for each policy, tracer and response, whatever
/// the degree, the camera and the outputs. Errors: invalid_argument for gradients or images of another size.

#include <gart/backward/backward.hpp>
#include <gart/math/sh_turn.hpp>

namespace gart { inline namespace GART_ISA {

/// Where gradients of rays go, [H][W][3] each in the policy's memory, in world axes; zero where no ray was traced.
struct ray_targets {
  float* direction = nullptr;  ///< dL/d direction
  float* origin = nullptr;     ///< dL/d origin; null where not wanted
};

namespace backward_kernels {

// The rays of a view with one centre or without.
struct rays_with_origins {
  pixel_rays rays;
  vec3 const* origins;  // null: all begin at the frame's origin
  GART_HD ray of(pixel p) const {
    vec3 const origin = origins ? origins[static_cast<std::size_t>(p.y) * rays.view.width + p.x] : vec3(0.0f);
    return {origin, rays.of(p.x, p.y).direction};
  }
};

// Walks the rays of the pixels again. Coefficients are read in their stride, so that one program serves all degrees.
template <class Response>
struct ray_gradients : ray_program_base {
  static constexpr int most = 3;  // degree
  using ray_type = ray;
  struct state {
    ray own;
    sh_basis<most> basis;
    ray_gradient gradient;
    float by_depth;
    u32 left;
    vec3 by_origin, by_direction, by_turn;  // sums over the hits; of colours, by a turn of the direction
  };

  rays_with_origins rays;
  pixel_order order;
  float const* sh;
  std::size_t sh_stride;
  int active_degree;
  float transmittance_min;
  u32 max_hits;
  ray_gaussian const* records;
  float const *color, *color_gradient;
  depth_image depth;
  ray_targets out;

  GART_HD bool active(index_t i) const { return order.inside(order.at(i)); }
  GART_HD pixel at(index_t i) const { return order.at(i); }
  GART_HD state begin(index_t i) const {
    std::size_t const at = order.address(order.at(i));
    state s;
    s.own = rays.of(order.at(i));
    s.basis = sh_basis<most>(s.own.direction);
    float const *c = color + 3 * at, *g = color_gradient + 3 * at;
    s.gradient.g = {g[0], g[1], g[2]};
    s.gradient.color_g = s.gradient.of({c[0], c[1], c[2]}) + depth.total(at);
    s.by_depth = depth.gradient(at);
    s.left = max_hits;
    s.by_origin = s.by_direction = s.by_turn = vec3(0.0f);
    return s;
  }
  GART_HD ray_type ray_of(index_t, state const& s) const { return s.own; }

  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    int const bands = sh_coefficients(active_degree);
    float const* const row = sh + sh_stride * h.id;
    vec3 const unclamped = s.basis.unclamped(row, bands);
    float weight;
    float const cg = s.gradient.of(clamped_color(unclamped)) + h.t * s.by_depth;
    float const alpha_gradient = s.gradient.pass(h.alpha, cg, weight);
    vec3 const g = color_gradient_of(unclamped, s.gradient.g, weight);
    float by_band[sh_basis<most>::size];
    GART_UNROLL
    for (int k = 0; k < sh_basis<most>::size; ++k)
      by_band[k] = k < bands ? row[3 * k] * g.x + row[3 * k + 1] * g.y + row[3 * k + 2] * g.z : 0.0f;
    s.by_turn += sh_turn<most, 1>(by_band, s.basis.y);
    ray_gaussian const gaussian = records[h.id];
    ray_peak const r = evaluate(gaussian, s.own);
    float const by_depth = weight * s.by_depth;
    moments_of<float> const m = hit_moments_with_depth<Response>(gaussian, r, alpha_gradient, by_depth, true);
    ray_part const part = ray_part_of(gaussian, r, m, by_depth);
    s.by_origin += part.origin, s.by_direction += part.direction;
    return s.gradient.transmittance >= transmittance_min && --s.left != 0;
  }

  GART_HD void end(index_t i, state const& s) const {
    std::size_t const at = 3 * order.address(order.at(i));
    vec3 const &d = s.own.direction, &w = s.by_turn;
    // A turn w moves the direction by w x d; a component along it changes its length alone.
    vec3 by = s.by_direction + glm::cross(w, d);
    by -= d * glm::dot(by, d);
    for (int k = 0; k < 3; ++k) {
      out.direction[at + static_cast<std::size_t>(k)] = by[k];
      if (out.origin) out.origin[at + static_cast<std::size_t>(k)] = s.by_origin[k];
    }
  }
};

}  // namespace backward_kernels

/// From the gradients of an image that the frame rendered, `color`, to those of its pixels' rays. `image` has the
/// gradients; those by depth and transmittance need the image's own in `depth`.
template <class Frame>
void differentiate_rays(Frame& frame, span<float const> color, image_gradients const& image, ray_targets const& out,
                        depth_image depth = {}) {
  auto& exec = frame.exec();
  auto const& view = frame.view();
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  if (color.size() != 3 * pixels || image.color.size() != 3 * pixels)
    throw invalid_argument("differentiate_rays: the image and its gradient must have three values for each pixel");
  for (span<float const> const& one : {image.depth, image.transmittance})
    if (!one.empty() && one.size() != pixels)
      throw invalid_argument(
          "differentiate_rays: a gradient by depth or transmittance must have a value for each pixel");
  if ((!image.depth.empty() && !depth.depth) || (!image.transmittance.empty() && !depth.transmittance))
    throw invalid_argument("differentiate_rays needs the image's depth or transmittance: give it with the gradient");
  if (!out.direction) throw invalid_argument("differentiate_rays: ray_targets.direction is needed");
  gaussians_view<float const> const scene = frame.scene();
  auto const& options = frame.options();
  stage_scope stage(exec, "rays backward");
  for (float* const target : {out.direction, out.origin})
    if (target) exec.zero(target, 3 * pixels * sizeof(float));
  backward_kernels::rays_with_origins rays{};
  frame.with_rays([&]<class Rays>(Rays const& own) {
    if constexpr (Rays::central)
      rays = {own, nullptr};
    else
      rays = {{own.view, own.directions}, own.origins};
  });
  pixel_order const order{view.width, view.height, options.rows};
  depth.depth_gradient = image.depth.data(), depth.transmittance_gradient = image.transmittance.data();
  using program = backward_kernels::ray_gradients<typename Frame::response>;
  frame.trace("backward/rays", order.launch_size(),
              program{{},
                      rays,
                      order,
                      scene.sh,
                      static_cast<std::size_t>(scene.sh_stride()),
                      frame.active_degree(),
                      options.transmittance_min,
                      options.max_hits,
                      frame.gaussians().data(),
                      color.data(),
                      image.color.data(),
                      depth,
                      out});
}

}}  // namespace gart::GART_ISA
