#pragma once
/// \file
/// How near rays from one point can hit a Gaussian where they pass through a parallelogram of a plane. A ray through d
/// = u x + v y + z reaches its hit at some factor times d. This is a lower bound of that factor for all u and v of a
/// rectangle. For the axes x, y, z of a camera, u and v are slopes. The factor is then the hit's depth in camera space.
///
/// With rows m_k of M the factor at the largest response is
///   N / Q,  N = -sum_k o_k (m_k . d),  Q = sum_k (m_k . d)^2.
/// N is linear in u and v and Q convex, so {N >= c Q} is convex for c >= 0. So N / Q is quasi-concave where it is
/// positive, and its least value over a rectangle lies at a corner. What rounding can move it, at a corner or at a hit,
/// is taken off N and added to |m_k . d| in a way that leaves the one linear and the other convex: the bound holds for
/// every ray.
///
/// Let the rays' origins be o + s h, -1 <= s <= 1. Then the bound is (N - k sqrt(Q)) / Q, k = |M h|, with N of rays
/// from o. Since sqrt(Q) is convex too, the least value still lies at a corner.

#include <gart/math/ray_gaussian.hpp>

namespace gart { inline namespace GART_ISA {

/// The bound, of one Gaussian.
class rectangle_depth {
 public:
  rectangle_depth() = default;
  /// `g`: relative to the point. plane: its columns are x, y and z. reach: at least |u| |x| + |v| |y| + |z| of every
  /// point asked for.
  GART_HD rectangle_depth(ray_gaussian const& g, mat3 const& plane, float reach) {
    loss_ = 0;
    for (int k = 0; k < 3; ++k) {
      vec3 const m(g.m[k].x, g.m[k].y, g.m[k].z);
      for (int j = 0; j < 3; ++j) m_[k][j] = m.x * plane[j].x + m.y * plane[j].y + m.z * plane[j].z;
      o_[k] = g.m[k].o;
      error_[k] = rounding * reach * (fabsf(m.x) + fabsf(m.y) + fabsf(m.z));
      loss_ += fabsf(o_[k]) * error_[k];
    }
  }

  /// At most the factor of any hit through [u0, u1] x [v0, v1]. It says nothing where it is not positive, or NaN.
  GART_HD GART_INLINE float operator()(float u0, float u1, float v0, float v1) const {
    float const a = at(u0, v0), b = at(u1, v0), c = at(u0, v1), d = at(u1, v1);
    float const ab = b < a ? b : a, cd = d < c ? d : c;
    return cd < ab ? cd : ab;
  }

 protected:
  static constexpr float rounding = 4e-6f;  // 64 of them

  struct quotient {
    float n, q;
  };
  GART_HD GART_INLINE quotient quotient_at(float u, float v) const {
    float n = -loss_, q = 0;
    GART_UNROLL
    for (int k = 0; k < 3; ++k) {
      float const d = m_[k][0] * u + m_[k][1] * v + m_[k][2];
      n -= o_[k] * d;
      float const widest = fabsf(d) + error_[k];
      q += widest * widest;
    }
    return {n, q};
  }

  vec3 m_[3];
  float o_[3], error_[3];
  float loss_;

 private:
  GART_HD GART_INLINE float at(float u, float v) const {
    quotient const r = quotient_at(u, v);
    return r.n / r.q * (1 - rounding);
  }
};

/// The bound of rays whose origins lie on a line.
class moving_rectangle_depth : rectangle_depth {
 public:
  /// As rectangle_depth's, of rays from origin - half to origin + half, relative to the point that `g` is.
  GART_HD moving_rectangle_depth(ray_gaussian g, mat3 const& plane, float reach, vec3 const& origin, vec3 const& half) {
    float moved2 = 0, rows2 = 0;
    for (int k = 0; k < 3; ++k) {
      vec3 const m(g.m[k].x, g.m[k].y, g.m[k].z);
      g.m[k].o += m.x * origin.x + m.y * origin.y + m.z * origin.z;
      float const by = m.x * half.x + m.y * half.y + m.z * half.z;
      moved2 += by * by, rows2 += m.x * m.x + m.y * m.y + m.z * m.z;
    }
    float const far =
        fabsf(origin.x) + fabsf(origin.y) + fabsf(origin.z) + fabsf(half.x) + fabsf(half.y) + fabsf(half.z);
    moved_ = sqrtf(moved2) * (1 + rounding) + rounding * far * sqrtf(rows2);
    static_cast<rectangle_depth&>(*this) = rectangle_depth(g, plane, reach);
  }

  /// At most the factor of any hit through [u0, u1] x [v0, v1]. It says nothing where it is not positive, or NaN.
  GART_HD float operator()(float u0, float u1, float v0, float v1) const {
    float least = at(u0, v0);
    for (int corner = 1; corner < 4; ++corner) {
      float const other = at(corner & 1 ? u1 : u0, corner & 2 ? v1 : v0);
      least = other < least ? other : least;
    }
    return least;
  }

 private:
  GART_HD float at(float u, float v) const {
    quotient const r = quotient_at(u, v);
    return (r.n - moved_ * sqrtf(r.q)) / r.q * (1 - rounding);
  }
  float moved_;
};

}}  // namespace gart::GART_ISA
