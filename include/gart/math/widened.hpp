#pragma once
/// \file
/// A Gaussian as a filter of standard deviation r sees it from the frame's origin. Every axis is widened by r. The
/// response is lowered, so that its integral across the line of sight stays the same.
///   S'^2 = S^2 + r^2,   sigma' = sigma sqrt(F),   F = prod S^2 d^T C^-1 d / (prod S'^2 d^T C'^-1 d),
/// C = R S^2 R^T the covariance in world axes, d the direction of the mean. For the largest response along rays of
/// direction d is a Gaussian of the plane across d. Its covariance is the projection of C onto that plane, whose
/// determinant is det C d^T C^-1 d. A filter adds r^2 to it. F is the ratio of the determinants, the square of that of
/// the areas. With u the direction in the Gaussian's axes and a_k = s_k^2 / r^2 both are sums of positive terms:
///   F = N / N',   N = sum u_k^2 a_i a_j,   N' = sum u_k^2 (1 + a_i)(1 + a_j)   ({i, j, k} all three axes).
/// Responses of another degree than 2 keep their own shape, and so their own integral.
///
/// The result is a gaussian_parameters again, so records, boxes and footprints take one and the same widened Gaussian.
/// Its arithmetic is fixed. Where it would be no Gaussian it is left alone, to be culled.

#include <gart/math/hit_gradient.hpp>

namespace gart { inline namespace GART_ISA {

/// The filter where a Gaussian is: its standard deviation, in world units, and how that changes with the mean.
struct filter_at {
  float sigma = 0;       ///< world units
  vec3 log_slope{0.0f};  ///< d ln sigma / d mean
};

/// The effect of the mean's direction on a Gaussian under a filter.
struct filtered_area {
  mat3 rotation;           ///< columns are the Gaussian's axes
  vec3 u;                  ///< unit, towards the mean in the Gaussian's axes
  vec3 ratio;              ///< s_k / r
  vec3 a;                  ///< its square
  float area, widened;     ///< N, N'
  float inverse_distance;  ///< 1 / distance of the mean, in world units
};

/// Beyond it a filter changes no digit of a scale, and products of three stay in range.
inline constexpr float largest_filter_ratio = 1048576.0f;

/// False where the filter does nothing: the mean is at the frame's origin, or the parameters are not a Gaussian's.
GART_HD GART_INLINE bool filtered_area_of(gaussian_parameters const& g, vec3 const& mean, float r, filtered_area& out) {
  float const distance2 = fma(mean.x, mean.x, fma(mean.y, mean.y, mul(mean.z, mean.z)));
  if (!is_gaussian(g) || !(distance2 > 1e-30f) || !(r > 1e-30f)) return false;
  out.rotation = to_matrix(g.rotation);
  out.inverse_distance = divide(1.0f, square_root(distance2));
  float square[3];
  for (int k = 0; k < 3; ++k) {
    vec3 const axis = out.rotation[k];
    float const along = fma(axis.x, mean.x, fma(axis.y, mean.y, mul(axis.z, mean.z)));
    out.u[k] = mul(along, out.inverse_distance);
    float const ratio = divide(exponential(g.log_scale[k]), r);
    out.ratio[k] = ratio < largest_filter_ratio ? ratio : largest_filter_ratio;
    out.a[k] = mul(out.ratio[k], out.ratio[k]);
    square[k] = mul(out.u[k], out.u[k]);
  }
  vec3 const& a = out.a;
  vec3 const b(add(a.x, 1.0f), add(a.y, 1.0f), add(a.z, 1.0f));
  out.area = fma(square[0], mul(a.y, a.z), fma(square[1], mul(a.z, a.x), mul(square[2], mul(a.x, a.y))));
  out.widened = fma(square[0], mul(b.y, b.z), fma(square[1], mul(b.z, b.x), mul(square[2], mul(b.x, b.y))));
  return true;
}

/// `mean` is relative to the frame.
GART_HD GART_INLINE gaussian_parameters widened(gaussian_parameters const& g, vec3 const& mean, float r) {
  filtered_area f;
  if (!filtered_area_of(g, mean, r, f)) return g;
  gaussian_parameters out = g;
  float const log_r = logarithm(r);
  for (int k = 0; k < 3; ++k) {
    bool const above = f.ratio[k] >= 1.0f;
    float const less = above ? divide(1.0f, f.a[k]) : f.a[k];
    out.log_scale[k] = fma(0.5f, logarithm(add(1.0f, less)), above ? g.log_scale[k] : log_r);
  }
  // sigma' / (1 - sigma'), without the digits that 1 - sigma' and 1 - sqrt(F) would lose near 0.
  float grown = 0;  // N' - N
  for (int k = 0; k < 3; ++k)
    grown = fma(mul(f.u[k], f.u[k]), add(1.0f, add(f.a[(k + 1) % 3], f.a[(k + 2) % 3])), grown);
  float const root = square_root(divide(f.area, f.widened));
  float const lost = divide(grown, mul(f.widened, add(1.0f, root)));  // 1 - sqrt(F)
  float const sigma = sigmoid(g.opacity);
  out.opacity = logarithm(divide(mul(sigma, root), fma(sigma, lost, sigmoid(-g.opacity))));
  return out;
}

/// The largest share of its opacity that a Gaussian keeps under a filter, over all directions. It keeps it along its
/// shortest axis, where the other two are widened. F is a mean of such products, weighted by the direction.
GART_HD GART_INLINE float largest_share_left(vec3 const& log_scale, float r) {
  float left[3];
  for (int k = 0; k < 3; ++k) {
    float const ratio = exponential(log_scale[k]) / r, square = ratio * ratio;
    left[k] = ratio < largest_filter_ratio ? square / (1.0f + square) : 1.0f;
  }
  float const first = left[0] > left[1] ? left[0] : left[1], less = left[0] > left[1] ? left[1] : left[0];
  return square_root(first * (less > left[2] ? less : left[2]));
}

/// From the gradient of the widened parameters to that of the stored ones. by_log_sigma is dL/d ln sigma', the moment
/// m0. Each may depend on the mean by the direction and by r, and on scales and rotation by F:
///   d ln s'_k / d ln s_k = a_k / (1 + a_k), the rest of 1 is d ln s'_k / d ln r;
///   1/2 d ln F / d ln s_k = a_k (N_k / N - N'_k / N') = h_k, N_k = dN / da_k;   1/2 d ln F / d ln r = -sum h_k;
///   1/2 d ln F / d u_k = u_k (a_i a_j / N - (1 + a_i)(1 + a_j) / N') = u_k e_k.
GART_HD GART_INLINE geometry_gradient pull_back_widened(geometry_gradient const& by, float by_log_sigma,
                                                        gaussian_parameters const& g, vec3 const& mean,
                                                        filter_at const& filter) {
  filtered_area f;
  if (!filtered_area_of(g, mean, filter.sigma, f) || !(f.area > 1e-37f)) return by;
  geometry_gradient out = by;
  float const inverse_area = 1.0f / f.area, inverse_widened = 1.0f / f.widened;
  float by_log_r = 0;
  vec3 ue;
  for (int k = 0; k < 3; ++k) {
    int const i = (k + 1) % 3, j = (k + 2) % 3;
    float const wi = f.u[i] * f.u[i], wj = f.u[j] * f.u[j], ai = f.a[i], aj = f.a[j], bi = 1 + ai, bj = 1 + aj;
    float const h = f.a[k] * ((wi * aj + wj * ai) * inverse_area - (wi * bj + wj * bi) * inverse_widened);
    float const b = 1.0f / (1 + f.a[k]);
    out.log_scale[k] = by.log_scale[k] * (f.a[k] * b) + by_log_sigma * h;
    by_log_r += by.log_scale[k] * b - by_log_sigma * h;
    ue[k] = f.u[k] * (ai * aj * inverse_area - bi * bj * inverse_widened);
  }
  vec3 const by_direction = f.rotation * ue * (by_log_sigma * f.inverse_distance);
  for (int k = 0; k < 3; ++k) out.mean[k] = by.mean[k] + by_direction[k] + by_log_r * filter.log_slope[k];
  // u turns against the body: du = u x w.
  vec3 const body(ue.y * f.u.z - ue.z * f.u.y, ue.z * f.u.x - ue.x * f.u.z, ue.x * f.u.y - ue.y * f.u.x);
  quaternion const turn = pull_back(g.rotation, body * by_log_sigma);
  out.rotation = {by.rotation.w + turn.w, by.rotation.x + turn.x, by.rotation.y + turn.y, by.rotation.z + turn.z};
  out.opacity = by_log_sigma * sigmoid(-g.opacity);
  return out;
}

}}  // namespace gart::GART_ISA
