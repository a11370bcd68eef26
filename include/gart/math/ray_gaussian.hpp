#pragma once
/// \file
/// A Gaussian as a ray meets it. In the Gaussian's own space (unit sphere, axes of the ellipsoid) a ray o + t d is
///   o_g = M (o - mu),  d_g = M d,  M = S^-1 R^T;
/// the response is largest at t = -o_g.d_g / d_g.d_g, where p = o_g + t d_g is the offset from the centre. There it is
/// rho(|p|^2), for a Gaussian exp(-|p|^2 / 2) (math/response.hpp). The ray hits where sigma * rho >= alpha_min and t >
/// near. The former holds where |p|^2 is at most the cutoff, 2 ln(sigma / alpha_min) for a Gaussian.
///
/// The offset is not computed from t. A rounding of t moves the point along the ray by 6e-8 of |o_g|. This is the
/// distance over the thinnest axis, which may be 1e8 and more. With c = o_g x d_g, which is the same from any point of
/// the ray,
///   |p|^2 = |c|^2 / |d_g|^2,   p = d_g x c / |d_g|^2,
/// and each product of c is off by a rounding of the distance over the axes that it is of. So in the world the point
/// stays within a few roundings of the distance, however thin the Gaussian. The ray itself does no better.
///
/// Everything is relative to a frame, a point of the world held in double (the camera's centre for primary rays). mu is
/// subtracted from it in double, so scenes far from the origin lose nothing. This file alone decides which candidates
/// are hits, and their t and alpha. Its arithmetic is fixed (arith.hpp).

#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/quaternion.hpp>
#include <gart/math/response.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// The largest alpha of a hit: above it alpha is clamped.
inline constexpr float alpha_max = 0.99f;

/// A ray from the frame's origin, cast by a camera.
template <class F>
struct primary_ray_of {
  vec3_of<F> direction;  ///< unit
};
/// Of one ray.
using primary_ray = primary_ray_of<float>;

/// From anywhere; `origin` relative to the frame.
template <class F>
struct ray_of {
  vec3_of<F> origin;     ///< relative to the frame
  vec3_of<F> direction;  ///< unit
};
/// One ray.
using ray = ray_of<float>;

///@{
/// Where the ray begins, relative to the frame.
GART_HD constexpr vec3 origin_of(primary_ray const&) { return vec3(0.0f); }
GART_HD constexpr vec3 origin_of(ray const& r) { return r.origin; }
///@}

/// One Gaussian in one frame, 64 bytes, loaded as four 16-byte words.
struct alignas(16) ray_gaussian {
  /// A row of M.
  struct alignas(16) row {
    float x, y, z;  ///< of M
    float o;        ///< of M (frame - mu)
  };
  row m[3];                  ///< the rows, an axis of the ellipsoid each
  float cutoff = -1;         ///< largest |p|^2 of a hit; negative: culled, never a hit
  float sigma = 0;           ///< opacity at the centre, (0, 1)
  float unused[2] = {0, 0};  ///< to 64 bytes
};

/// The parameters of one Gaussian as stored.
struct gaussian_parameters {
  vec3 mean;            ///< world units
  vec3 log_scale;       ///< natural logarithms of the standard deviations
  quaternion rotation;  ///< of any norm
  float opacity;        ///< logit
};

/// The mean in the frame.
GART_HD GART_INLINE vec3 relative_mean(vec3 const& mean, vec3d const& frame) {
  return {static_cast<float>(mean.x - frame.x), static_cast<float>(mean.y - frame.y),
          static_cast<float>(mean.z - frame.z)};
}

/// False where the parameters are not finite or make no ellipsoid in float.
GART_HD GART_INLINE bool is_gaussian(gaussian_parameters const& g) {
  return is_finite(g.mean.x) && is_finite(g.mean.y) && is_finite(g.mean.z) && is_finite(g.opacity) &&
         is_finite(norm2(g.rotation)) && norm2(g.rotation) > quaternion_norm2_min && g.log_scale.x > -40.0f &&
         g.log_scale.x < 40.0f && g.log_scale.y > -40.0f && g.log_scale.y < 40.0f && g.log_scale.z > -40.0f &&
         g.log_scale.z < 40.0f;
}

/// Largest |p|^2 of a hit; negative where the Gaussian is never hit (too weak, or its parameters are not finite).
template <class Response = generalized_gaussian<>>
GART_HD GART_INLINE float hit_cutoff(gaussian_parameters const& g, float alpha_min) {
  float const sigma = sigmoid(g.opacity);
  if (!is_gaussian(g) || !(sigma >= alpha_min)) return -1.0f;
  return Response::cutoff(divide(sigma, alpha_min));
}

/// Standard deviations along the axes, world units.
GART_HD GART_INLINE vec3 scale_of(gaussian_parameters const& g) {
  return {exponential(g.log_scale.x), exponential(g.log_scale.y), exponential(g.log_scale.z)};
}

/// What rays meet of a Gaussian in a frame; culled where no hit reaches alpha_min.
template <class Response = generalized_gaussian<>>
GART_HD GART_INLINE ray_gaussian prepare(gaussian_parameters const& g, vec3d const& frame, float alpha_min) {
  ray_gaussian out;
  out.cutoff = hit_cutoff<Response>(g, alpha_min);
  out.sigma = sigmoid(g.opacity);
  if (out.cutoff < 0) {
    for (auto& row : out.m) row = {0, 0, 0, 0};
    return out;
  }
  mat3 const rotation = to_matrix(g.rotation);
  vec3 const to_frame = -relative_mean(g.mean, frame);
  float largest = 0;  // that o_g.d_g may be
  for (int k = 0; k < 3; ++k) {
    float const inverse = exponential(-g.log_scale[k]);
    vec3 const axis = rotation[k];
    float const along = fma(axis.x, to_frame.x, fma(axis.y, to_frame.y, mul(axis.z, to_frame.z)));
    out.m[k] = {mul(axis.x, inverse), mul(axis.y, inverse), mul(axis.z, inverse), mul(along, inverse)};
    largest = fma(fabsf(out.m[k].o), mul(2.0f, inverse), largest);  // |d| is 1 but for rounding
  }
  if (!is_finite(largest)) out.cutoff = -1;  // t would not be
  return out;
}

/// Where along a ray the response is largest; of one ray, or of one a lane.
template <class F>
struct ray_peak_of {
  F t;           ///< distance of the largest response along the ray
  F d2;          ///< |p|^2 there
  vec3_of<F> c;  ///< o_g x d_g / |d_g|^2
  vec3_of<F> d;  ///< d_g
  F inverse;     ///< 1 / |d_g|^2
};
/// Of one ray.
using ray_peak = ray_peak_of<float>;

///@{
/// One row of o_g.
template <class F>
GART_HD GART_INLINE F gaussian_origin(ray_gaussian::row const& m, primary_ray_of<F> const&) {
  return m.o;
}
template <class F>
GART_HD GART_INLINE F gaussian_origin(ray_gaussian::row const& m, ray_of<F> const& r) {
  return fma(F(m.x), r.origin.x, fma(F(m.y), r.origin.y, fma(F(m.z), r.origin.z, F(m.o))));
}
///@}

/// a x b.
template <class F>
GART_HD GART_INLINE vec3_of<F> cross_product(vec3_of<F> const& a, vec3_of<F> const& b) {
  return {fma(a.y, b.z, -mul(a.z, b.y)), fma(a.z, b.x, -mul(a.x, b.z)), fma(a.x, b.y, -mul(a.y, b.x))};
}

/// A ray in the Gaussian's own space, before the division.
template <class F>
struct approach_of {
  vec3_of<F> c, d;  ///< o_g x d_g and d_g
  F od, cc, dd;     ///< o_g.d_g, |c|^2 and |d_g|^2
};
/// Of one ray.
using approach = approach_of<float>;

/// Of a ray, or of one a lane.
template <class Ray>
GART_HD GART_INLINE auto approach_to(ray_gaussian const& g, Ray const& r) {
  using F = std::remove_cvref_t<decltype(r.direction.x)>;
  approach_of<F> a;
  vec3_of<F> o;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    o[k] = gaussian_origin(g.m[k], r);
    a.d[k] = fma(F(g.m[k].x), r.direction.x, fma(F(g.m[k].y), r.direction.y, mul(F(g.m[k].z), r.direction.z)));
  }
  a.c = cross_product(o, a.d);
  a.od = fma(o.x, a.d.x, fma(o.y, a.d.y, mul(o.z, a.d.z)));
  a.cc = fma(a.c.x, a.c.x, fma(a.c.y, a.c.y, mul(a.c.z, a.c.z)));
  // No hit where o_g.d_g is infinite; for primary rays prepare sees to that.
  if constexpr (std::is_same_v<Ray, ray_of<F>>) a.cc = fma(F(0.0f), a.od, a.cc);
  a.dd = fma(a.d.x, a.d.x, fma(a.d.y, a.d.y, mul(a.d.z, a.d.z)));
  return a;
}

/// inverse: 1 / a.dd
template <class F>
GART_HD GART_INLINE ray_peak_of<F> ray_peak_of_approach(approach_of<F> const& a, F inverse) {
  ray_peak_of<F> out;
  out.c = {mul(a.c.x, inverse), mul(a.c.y, inverse), mul(a.c.z, inverse)};
  out.d = a.d;
  out.inverse = inverse;
  out.t = mul(-a.od, inverse);
  out.d2 = mul(a.cc, inverse);
  return out;
}

/// Where along the ray the response is largest.
template <class Ray>
GART_HD GART_INLINE auto evaluate(ray_gaussian const& g, Ray const& r) {
  auto const a = approach_to(g, r);
  return ray_peak_of_approach(a, reciprocal(a.dd));
}

/// N at once, interleaved to hide the latency of each one's chain of steps. `of(i)` is the i-th approach.
template <int N, class F>
GART_HD GART_INLINE void evaluate_all(ray_peak (&out)[N], F&& of) {
  approach a[N];
  float inverse[N];
  GART_UNROLL
  for (int i = 0; i < N; ++i) a[i] = of(i), inverse[i] = a[i].dd;
  reciprocals(inverse);
  GART_UNROLL
  for (int i = 0; i < N; ++i) out[i] = ray_peak_of_approach(a[i], inverse[i]);
}

/// p, in standard deviations along the Gaussian's axes. Along the thin axis of a pancake it is all but zero. In the
/// gradients of mean and rotation M magnifies it. The product has its digits; o_g + t d_g has none.
template <class F>
GART_HD GART_INLINE vec3_of<F> offset_of(ray_peak_of<F> const& r) {
  return cross_product(r.d, r.c);
}

/// NaN compares false: what cannot be evaluated is no hit.
template <class F>
GART_HD GART_INLINE auto is_hit(ray_gaussian const& g, ray_peak_of<F> const& r, float near) {
  return both(r.d2 <= F(g.cutoff), r.t > F(near));
}

namespace detail {

template <class F>
GART_HD GART_INLINE F clamped_alpha(F a) {
  return select(a < F(alpha_max), a, F(alpha_max));
}

}  // namespace detail

///@{
/// Of the squared offset at a hit, r.d2.
template <class Response = generalized_gaussian<>, class F>
GART_HD GART_INLINE F unclamped_alpha(ray_gaussian const& g, F d2) {
  return mul(F(g.sigma), Response::response(d2));
}
/// For its gradient.
template <class Response = generalized_gaussian<>, class F>
GART_HD GART_INLINE F estimated_unclamped_alpha(ray_gaussian const& g, F d2) {
  return mul(F(g.sigma), Response::estimated_response(d2));
}
///@}

/// @{ The alpha that a hit blends with: at most alpha_max.
template <class Response = generalized_gaussian<>, class F>
GART_HD GART_INLINE F hit_alpha(ray_gaussian const& g, F d2) {
  return detail::clamped_alpha(unclamped_alpha<Response>(g, d2));
}
/// For its gradient.
template <class Response = generalized_gaussian<>, class F>
GART_HD GART_INLINE F estimated_hit_alpha(ray_gaussian const& g, F d2) {
  return detail::clamped_alpha(estimated_unclamped_alpha<Response>(g, d2));
}
///@}

}}  // namespace gart::GART_ISA
