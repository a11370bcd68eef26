#pragma once
/// \file
/// Gradients of one hit and of one Gaussian: the only gradient code of the renderer.
///
/// With w = T alpha, a hit of colour c adds w c to its ray and leaves T (1 - alpha). Let L be the colour before the
/// hit, C the pixel's colour and g the image gradient. V = L + T c is the colour that the pixel would have if the hit
/// were opaque. Then
///   C = alpha V + (1 - alpha) (the colour without the hit),   dL/dalpha = (V - C).g / (1 - alpha),   dL/dc = w g.
/// alpha = sigma rho(|p|^2). Let a = alpha dL/dalpha, and b = a times the slope of ln rho (math/response.hpp; b = a for
/// a Gaussian). Then the geometry needs only ten sums over the hits, the moments, all in the Gaussian's own space:
///   m0 = sum a,  m1 = sum b p,  m2 = sum b p p^T
///   dL/d logit = sigmoid(-logit) m0      dL/d mean = M^T m1           dL/d log s_k = m2_kk
///   dL/d rotation (body frame)_i = m2_jk (s_j / s_k - s_k / s_j), (i, j, k) cyclic
/// for x = mean + R S p is the point of largest response and dL/dM = -(sum b p p^T)(R S)^T. Where a clamp is active
/// (alpha at alpha_max, a colour at 0) the derivative through it is zero.
///
/// The depth sum w t is composited as a channel of colour t. But t has a gradient of its own. At the point of largest
/// response d_g.p = 0. So with e = w dL/d depth / |d_g|^2 the same sums take it in:
///   m1 += e d_g,  m2 += e (p d_g^T + d_g p^T).
///
/// A ray o + t d passes the point at t. So what moves the Gaussian by dx moves the ray by -dx. A hit gives
///   dL/do = -M^T m1,   dL/dd = -M^T (t m1 + e p),
/// the last term by how t itself changes, dt = -(p + t d_g).M dd / |d_g|^2. Neither
/// includes how colour changes with d, nor what changes the length of d.

#include <gart/math/quaternion.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/math/sh.hpp>

namespace gart { inline namespace GART_ISA {

/// The ten sums, as floats in memory: m0, m1 xyz, m2 xx yy zz yz xz xy. Then the error seen through the Gaussian: the
/// sum over its hits of w times the pixel's error. By it densification finds where more are needed. Then one of padding
/// (16-byte words).
inline constexpr int moment_count = 11;
inline constexpr int error_place = 10;    ///< number of the error among them
inline constexpr int moment_stride = 12;  ///< floats a Gaussian

/// The share of one hit in the sums; of one hit, or of one a lane.
template <class F>
struct moments_of {
  F v[moment_stride];  ///< as above
};

/// 1 / a where it decides no hit: on a device by its estimate, within 2^-23.
template <class F>
GART_HD GART_INLINE F estimated_reciprocal(F a) {
#if defined(__CUDA_ARCH__)
  float r;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(a));
  return r;
#else
  return reciprocal(a);
#endif
}

/// dL/dalpha of a hit: V.g and C.g.
template <class F>
GART_HD GART_INLINE F alpha_gradient(F opaque_g, F color_g, F alpha) {
  return (opaque_g - color_g) * estimated_reciprocal(F(1.0f) - alpha);
}

/// The front-to-back walk of a ray's gradient.
struct ray_gradient {
  vec3 g;                   ///< dL/d colour of the pixel
  float color_g;            ///< C.g, the background in it
  float front = 0;          ///< L.g
  float transmittance = 1;  ///< T before the hit

  /// c.g of a hit.
  GART_HD GART_INLINE float of(vec3 color) const { return color.x * g.x + color.y * g.y + color.z * g.z; }
  /// dL/dalpha of the hit; moves past it. `weight` returns w.
  GART_HD GART_INLINE float pass(float alpha, vec3 color, float& weight) { return pass(alpha, of(color), weight); }
  /// The same by c.g, that of all channels there are.
  GART_HD GART_INLINE float pass(float alpha, float cg, float& weight) {
    float const gradient = alpha_gradient(front + transmittance * cg, color_g, alpha);
    weight = transmittance * alpha;
    front += weight * cg;
    transmittance *= 1.0f - alpha;
    return gradient;
  }
};

namespace detail {

// a and b of a hit, and p; zeros where it is none, whatever the rest is then.
template <class F>
struct hit_terms {
  F a, b;
  vec3_of<F> p;
};
template <class Response, class F, class Mask>
GART_HD GART_INLINE hit_terms<F> terms_of_hit(ray_gaussian const& gaussian, ray_peak_of<F> const& r, F alpha_gradient,
                                              Mask hit) {
  F const raw = estimated_unclamped_alpha<Response>(gaussian, r.d2), zero = 0.0f;
  F const a = select(both(hit, raw < F(alpha_max)), raw * alpha_gradient, zero);
  F const b = select(hit, a * Response::slope(r.d2), zero);
  vec3_of<F> const offset = offset_of(r);
  return {a, b, {select(hit, offset.x, zero), select(hit, offset.y, zero), select(hit, offset.z, zero)}};
}

}  // namespace detail

/// The share of a hit in the moments; zeros where `hit` is false, whatever the rest is then.
template <class Response = generalized_gaussian<>, class F, class Mask>
GART_HD GART_INLINE moments_of<F> hit_moments(ray_gaussian const& gaussian, ray_peak_of<F> const& r, F alpha_gradient,
                                              Mask hit) {
  auto const [a, b, p] = detail::terms_of_hit<Response>(gaussian, r, alpha_gradient, hit);
  vec3_of<F> const bp = {b * p.x, b * p.y, b * p.z};
  return {{a, bp.x, bp.y, bp.z, bp.x * p.x, bp.y * p.y, bp.z * p.z, bp.y * p.z, bp.x * p.z, bp.x * p.y, 0.0f, 0.0f}};
}

/// Of a hit that is one.
template <class Response = generalized_gaussian<>, class F>
GART_HD GART_INLINE moments_of<F> hit_moments(ray_gaussian const& gaussian, ray_peak_of<F> const& r, F alpha_gradient) {
  return hit_moments<Response>(gaussian, r, alpha_gradient, F(0.0f) <= F(0.0f));
}

/// The same where t has a gradient too; `depth_gradient` is w dL/d depth. With v = e d_g and h = b p + v the first
/// moments are h, the second p h^T + v p^T. d_g is finite, hit or not.
template <class Response = generalized_gaussian<>, class F, class Mask>
GART_HD GART_INLINE moments_of<F> hit_moments_with_depth(ray_gaussian const& gaussian, ray_peak_of<F> const& r,
                                                         F alpha_gradient, F depth_gradient, Mask hit) {
  auto const [a, b, p] = detail::terms_of_hit<Response>(gaussian, r, alpha_gradient, hit);
  F const e = select(hit, depth_gradient * r.inverse, F(0.0f));
  vec3_of<F> const v = {e * r.d.x, e * r.d.y, e * r.d.z};
  vec3_of<F> const h = {b * p.x + v.x, b * p.y + v.y, b * p.z + v.z};
  return {{a, h.x, h.y, h.z, p.x * (h.x + v.x), p.y * (h.y + v.y), p.z * (h.z + v.z), p.y * h.z + p.z * v.y,
           p.x * h.z + p.z * v.x, p.x * h.y + p.y * v.x, 0.0f, 0.0f}};
}

/// M^T v: from the Gaussian's own space to the world, for gradients that are pulled back through M.
GART_HD GART_INLINE vec3 to_world(ray_gaussian const& g, float x, float y, float z) {
  return {g.m[0].x * x + g.m[1].x * y + g.m[2].x * z, g.m[0].y * x + g.m[1].y * y + g.m[2].y * z,
          g.m[0].z * x + g.m[1].z * y + g.m[2].z * z};
}

/// The share of one hit in the gradient of its ray.
struct ray_part {
  vec3 origin, direction;  ///< dL/do, dL/dd
};
/// From its moments, the depth's in them; `by_depth` is w dL/d depth.
GART_HD GART_INLINE ray_part ray_part_of(ray_gaussian const& g, ray_peak const& r, moments_of<float> const& m,
                                         float by_depth) {
  vec3 const along = to_world(g, m.v[1], m.v[2], m.v[3]), p = offset_of(r);
  float const e = by_depth * r.inverse;
  return {-along, -r.t * along - to_world(g, e * p.x, e * p.y, e * p.z)};
}

/// Of a Gaussian's stored parameters.
struct geometry_gradient {
  vec3 mean, log_scale;  ///< [3] each
  quaternion rotation;   ///< of the raw quaternion
  float opacity;         ///< of the logit
};

/// From the sums over all hits to the stored parameters.
GART_HD GART_INLINE geometry_gradient from_moments(float const* m, gaussian_parameters const& p,
                                                   ray_gaussian const& g) {
  geometry_gradient out;
  out.opacity = m[0] * sigmoid(-p.opacity);  // 1 - sigma would lose its digits as sigma nears 1
  out.mean = to_world(g, m[1], m[2], m[3]);
  out.log_scale = {m[4], m[5], m[6]};
  auto const anisotropy = [&](int j, int k) {
    float const ratio = exponential(p.log_scale[j] - p.log_scale[k]);
    return ratio - 1.0f / ratio;
  };
  vec3 const body(m[7] * anisotropy(1, 2), m[8] * anisotropy(2, 0), m[9] * anisotropy(0, 1));
  out.rotation = pull_back(p.rotation, body);
  return out;
}

/// A colour channel passes its gradient where it is not clamped at zero.
GART_HD GART_INLINE vec3 color_gradient_of(vec3 unclamped, vec3 g, float weight) {
  return {shows(unclamped.x) ? weight * g.x : 0.0f, shows(unclamped.y) ? weight * g.y : 0.0f,
          shows(unclamped.z) ? weight * g.z : 0.0f};
}

}}  // namespace gart::GART_ISA
