#pragma once
/// \file
/// The backward pass by pixel: every ray is traced again and adds each hit's gradient to its Gaussian, atomically.
/// Terms choose what it adds: 3 K floats of colour (K SH coefficients a channel), the 10 moments of geometry
/// (math/hit_gradient.hpp). Cost: a second trace, and a row of atomics a hit and term.

#include <gart/backward/depth.hpp>
#include <gart/backward/terms.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/sh.hpp>
#include <gart/render/options.hpp>
#include <gart/render/pixels.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/trace/ray_program.hpp>

namespace gart { inline namespace GART_ISA {

/// The ray program of the backward pass by pixel (trace/ray_program.hpp).
template <int ShDegree, class Response, class Terms, execution E, rays_of_pixels Rays = pixel_rays>
struct scatter_program : ray_program_base {
  /// From the camera's centre, or from anywhere.
  using ray_type = typename Rays::ray_type;
  static constexpr int sh_stride = 3 * sh_basis<ShDegree>::size;  ///< floats of a Gaussian's coefficients
  /// A ray on its way.
  struct state {
    vec3 direction;  ///< of the ray, unit length
    /// SH functions of the direction.
    sh_basis<ShDegree> basis;
    ray_gradient gradient;                       ///< light behind the hit
    float error;                                 ///< of the pixel
    u32 left;                                    ///< hits until the cap; from 0, no cap, it counts down past it
    float depth_gradient[Terms::depth ? 1 : 0];  ///< of the pixel, where there is one
    vec3 origin[Rays::central ? 0 : 1];          ///< of the ray, where it has one
  };

  Rays rays;                     ///< of the view
  pixel_order order;             ///< of the view
  float const* sh = nullptr;     ///< coefficients, [N][K][3]
  int active_degree = ShDegree;  ///< bands above it have no gradient
  float transmittance_min = 0;   ///< as the forward pass had it
  u32 max_hits = 0;              ///< as the forward pass had it; 0: no cap
  /// [N], in the view's frame.
  ray_gaussian const* records = nullptr;
  float const* color = nullptr;           ///< [H][W][3], as the forward pass left it, background in it
  float const* color_gradient = nullptr;  ///< [H][W][3]
  float const* error = nullptr;           ///< [H][W], or null
  float* sh_gradient = nullptr;           ///< [N][K][3]
  float* moments_out = nullptr;           ///< [N][moment_stride]
  /// What depth needs, where it has a gradient.
  depth_image depth;

  /// Whether ray i is of a pixel of the image.
  GART_HD bool active(index_t i) const { return order.inside(order.at(i)); }
  /// The pixel of ray i.
  GART_HD pixel at(index_t i) const { return order.at(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const {
    state s;
    pixel const at = order.at(i);
    ray_type const r = pixel_ray(rays, at);
    s.direction = r.direction;
    if constexpr (!Rays::central) s.origin[0] = r.origin;
    s.basis = sh_basis<ShDegree>(s.direction);
    float const* c = color + 3 * order.address(at);
    float const* g = color_gradient + 3 * order.address(at);
    s.gradient.g = {g[0], g[1], g[2]};
    s.error = error ? error[order.address(at)] : 0.0f;
    s.left = max_hits;
    s.gradient.color_g = c[0] * g[0] + c[1] * g[1] + c[2] * g[2];
    if constexpr (Terms::depth) {
      s.depth_gradient[0] = depth.gradient(order.address(at));
      s.gradient.color_g += depth.total(order.address(at));
    }
    return s;
  }
  /// Ray i, in the view's frame.
  GART_HD ray_type ray_of(index_t, state const& s) const { return ray_of(s); }
  /// The ray of a state.
  GART_HD GART_INLINE ray_type ray_of(state const& s) const {
    if constexpr (Rays::central)
      return {s.direction};
    else
      return {s.origin[0], s.direction};
  }

  /// Adds a hit's gradient to its Gaussian. False: the ray ends.
  GART_KERNEL GART_INLINE bool on_hit(state& s, hit const& h) const {
    vec3 const unclamped =
        s.basis.unclamped(sh_row<ShDegree>(sh + static_cast<std::size_t>(sh_stride) * h.id, active_degree).v);
    float weight, hit_g = s.gradient.of(clamped_color(unclamped));
    if constexpr (Terms::depth) hit_g += h.t * s.depth_gradient[0];
    float const alpha_gradient = s.gradient.pass(h.alpha, hit_g, weight);
    if constexpr (Terms::color) {
      vec3 const g = color_gradient_of(unclamped, s.gradient.g, weight);
      float row[sh_stride] = {};
      GART_UNROLL
      for (int k = 0; k < sh_basis<ShDegree>::size; ++k) {
        if (k == sh_coefficients(active_degree)) break;
        row[3 * k] = s.basis.y[k] * g.x;
        row[3 * k + 1] = s.basis.y[k] * g.y;
        row[3 * k + 2] = s.basis.y[k] * g.z;
      }
      E::atomic_add_row(sh_gradient + static_cast<std::size_t>(sh_stride) * h.id, row,
                        3 * sh_coefficients(active_degree));
    }
    if constexpr (Terms::geometry) {
      ray_gaussian const g = records[h.id];
      ray_peak const r = evaluate(g, ray_of(s));
      moments_of<float> m;
      if constexpr (Terms::depth)
        m = hit_moments_with_depth<Response>(g, r, alpha_gradient, weight * s.depth_gradient[0], true);
      else
        m = hit_moments<Response>(g, r, alpha_gradient);
      m.v[error_place] = weight * s.error;
      E::atomic_add_row(moments_out + static_cast<std::size_t>(moment_stride) * h.id, m.v, moment_count);
    }
    return s.gradient.transmittance >= transmittance_min && --s.left != 0;
  }
  /// Nothing.
  GART_HD void end(index_t, state const&) const {}
};

}}  // namespace gart::GART_ISA
