#pragma once
/// \file
/// The silhouette of a Gaussian seen from a point, on a plane of rays. It tells whether a rectangle of the plane can be
/// hit. A box about the silhouette holds it. Where a long silhouette lies across the box, most of the box is empty.
///
/// Directions are x dx + y dy + z of the plane's columns. Let the ellipsoid be m + A s, |s| <= 1, in these axes. Let
/// slopes be relative to its centre's, b_i = A_i - (m_i / m_z) A_z for i = x, y. Then the silhouette is the ellipse
///   {c + L s, |s| <= 1},  S = L L^T = (b_i . b_j) / W + e_i e_j,  W = m_z^2 - |A_z|^2,
///   c = m / m_z + e,      e_i = -(b_i . A_z) / W:
/// sums of what does not cancel. It holds Cholesky's L, L^-1 q = (q_x / l_xx, (q_y - (S_xy / S_xx) q_x) / l_yy). As for
/// a box (math/footprint.hpp), it is widened by how far float arithmetic can move a hit. An ellipse of (1 + k) S + (1 +
/// 1 / k) pad^2 holds one of S widened by pad. It is computed in double; questions about rectangles are in float. Where
/// some of the ellipsoid is not in front of the point every rectangle meets it.

#include <gart/math/footprint.hpp>

namespace gart { inline namespace GART_ISA {

/// An ellipse on a plane of rays.
class silhouette {
 public:
  /// Everything meets it.
  silhouette() = default;
  /// `g`: relative to the point. to_plane: the inverse of the plane's columns (dx, dy, z), dx and dy about a pixel.
  GART_HD silhouette(ray_gaussian const& g, mat3d const& to_plane) {
    if (g.cutoff < 0) return;
    vec3d m(0.0), a[3];
    double const c = sqrt(static_cast<double>(g.cutoff));
    double reach = 0;  // at least |m| and |A_k| together
    for (int k = 0; k < 3; ++k) {
      vec3d const row(g.m[k].x, g.m[k].y, g.m[k].z);
      double const inverse = 1 / dot(row, row), away = inverse * static_cast<double>(g.m[k].o);
      m -= row * away, a[k] = row * (inverse * c);
      reach += fabs(a[k].x) + fabs(a[k].y) + fabs(a[k].z);
    }
    reach += fabs(m.x) + fabs(m.y) + fabs(m.z);
    m = to_plane * m;
    for (vec3d& each : a) each = to_plane * each;
    double const depth = sqrt(a[0].z * a[0].z + a[1].z * a[1].z + a[2].z * a[2].z);
    double const error = rounding_of_hits * reach, nearest = m.z - depth - error;
    if (!(nearest > 0)) return;
    double const inverse_z = 1 / m.z, x = m.x * inverse_z, y = m.y * inverse_z;
    double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, across = 0;
    for (int k = 0; k < 3; ++k) {
      double const bx = a[k].x - x * a[k].z, by = a[k].y - y * a[k].z;
      xx += bx * bx, xy += bx * by, yy += by * by, xz += bx * a[k].z, yz += by * a[k].z;
      across += fabs(to_plane[k].x) + fabs(to_plane[k].y);
    }
    double const w = 1 / ((m.z - depth) * (m.z + depth)), ex = -xz * w, ey = -yz * w, cx = x + ex, cy = y + ey;
    double const pad = 0.01 + across * error / nearest + 4e-7 * (fabs(cx) + fabs(cy));
    constexpr double wider = 1.01, wider_by = 101;
    double const sxx = wider * (xx * w + ex * ex) + wider_by * pad * pad, sxy = wider * (xy * w + ex * ey),
                 syy = wider * (yy * w + ey * ey) + wider_by * pad * pad, y_by_x = sxy / sxx;
    x_ = static_cast<float>(cx), y_ = static_cast<float>(cy);
    y_by_x_ = static_cast<float>(y_by_x), x_by_y_ = static_cast<float>(sxy) / static_cast<float>(syy);
    inverse_x_ = 1 / sqrtf(static_cast<float>(sxx)), inverse_y_ = 1 / sqrtf(static_cast<float>(syy - sxy * y_by_x));
  }

  /// Whether a ray through [x0, x1] x [y0, y1] may hit. The nearest point of a rectangle that does not hold the
  /// ellipse's centre lies on a side that faces it.
  GART_HD GART_INLINE bool meets(float x0, float x1, float y0, float y1) const {
    x0 -= x_, x1 -= x_, y0 -= y_, y1 -= y_;
    bool const beside = x0 > 0 || x1 < 0;
    bool const above = y0 > 0 || y1 < 0;
    bool met = !beside && !above;
    if (beside) {
      float const x = x0 > 0 ? x0 : x1;
      met = met || is_inside(x, clamped(y_by_x_ * x, y0, y1));
    }
    if (above) {
      float const y = y0 > 0 ? y0 : y1;
      met = met || is_inside(clamped(x_by_y_ * y, x0, x1), y);
    }
    return met;
  }

 private:
  GART_HD static double dot(vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
  GART_HD GART_INLINE static float clamped(float v, float lo, float hi) { return v < lo ? lo : v > hi ? hi : v; }
  // NaN is: what cannot be told may be hit.
  GART_HD GART_INLINE bool is_inside(float x, float y) const {
    float const u = x * inverse_x_, v = (y - y_by_x_ * x) * inverse_y_;
    return !(u * u + v * v > 1);
  }

  float x_ = 0, y_ = 0;                  // the centre
  float y_by_x_ = 0, x_by_y_ = 0;        // S_xy / S_xx and S_xy / S_yy: where a line down or across is nearest
  float inverse_x_ = 0, inverse_y_ = 0;  // 1 / l_xx and 1 / l_yy
};

}}  // namespace gart::GART_ISA
