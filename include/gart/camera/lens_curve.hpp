#pragma once
/// \file
/// The curve of a lens and its way back. A direction at the angle theta from the axis first has the distance q(theta)
/// from it. Each kind of lens has its q:
///   perspective  q = tan theta
///   fisheye      q = theta
///   fov          q = atan2(b sin theta, cos theta) / omega,   b = 2 tan(omega / 2)
///   eucm         q = sin theta / (alpha sqrt(beta sin^2 theta + cos^2 theta) + (1 - alpha) cos theta)
///   division     q / (1 + k1 q^2) = tan theta
/// Then let x = q (cos phi, sin phi) and R(q^2) = (1 + k1 q^2 + ... + k6 q^12) / (1 + d1 q^2 + d2 q^4 + d3 q^6). The
/// image point is x R + T(x), for fisheye624 y + T(y) of y = x R. Its unit is the focal length, its origin the
/// principal point. With r the length of its argument, T is
///   T_x = 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4,   T_y = 2 p2 x y + p1 (r^2 + 2 y^2) + s3 r^2 + s4 r^4.
/// All kinds go beyond 90 degrees but the perspective one, as far as they say something there.
///
/// The models: COLMAP, src/colmap/sensor/models.h; Kannala and Brandt, PAMI 2006; Devernay and Faugeras, 2001;
/// Khomutenko et al., RA-L 2016 (eucm); Fitzgibbon, CVPR 2001 (division).

#include <gart/math/fixed_double.hpp>
#include <gart/scene/camera.hpp>

namespace gart { inline namespace GART_ISA {

/// A direction in the plane of the axis, of any length.
template <class F>
struct meridian_direction {
  F sine, cosine;  ///< across the axis, along it
};

/// The terms of a lens, in double. F: double, or fixed_double where bits count.
class lens_curve {
 public:
  lens_curve() = default;
  /// Of a camera's lens.
  GART_HD lens_curve(camera_kind kind, distortion const& l)
      : kind_(kind == camera_kind::fisheye624 ? camera_kind::fisheye : kind),
        after_(kind == camera_kind::fisheye624),
        beside_(l.p1 != 0 || l.p2 != 0 || l.s1 != 0 || l.s2 != 0 || l.s3 != 0 || l.s4 != 0),
        k_{l.k1, l.k2, l.k3, l.k4, l.k5, l.k6},
        d_{l.d1, l.d2, l.d3},
        p1_(l.p1),
        p2_(l.p2),
        s_{l.s1, l.s2, l.s3, l.s4} {
    if (kind == camera_kind::fov) a_ = l.omega, b_ = 2 * tan(0.5 * l.omega);
    if (kind == camera_kind::eucm) a_ = l.alpha, b_ = l.beta;
    if (kind == camera_kind::division) a_ = l.k1;
    if (kind != camera_kind::perspective && kind_ != camera_kind::fisheye) {
      for (double& k : k_) k = 0;
      for (double& d : d_) d = 0;
    }
  }

  /// Whether there are tangential or thin prism terms.
  GART_HD bool beside() const { return beside_; }
  /// Whether these are derivatives of the radial terms.
  GART_HD bool after() const { return after_; }

  /// q and its derivative by the angle; not finite where the kind says nothing.
  GART_HD void curve(double theta, double& q, double& slope) const {
    double const s = sin(theta), c = cos(theta);
    switch (kind_) {
      case camera_kind::fov:
        q = atan2(b_ * s, c) / a_;
        slope = b_ / (a_ * (c * c + b_ * b_ * s * s));
        return;
      case camera_kind::eucm: {
        double const root = sqrt(b_ * s * s + c * c), under = a_ * root + (1 - a_) * c;
        double const by_theta = a_ * (b_ - 1) * s * c / root - (1 - a_) * s;
        q = under > 0 ? s / under : 1e300;
        slope = under > 0 ? (c * under - s * by_theta) / (under * under) : -1;
        return;
      }
      case camera_kind::division: {
        double const square = c * c - 4 * a_ * s * s, root = sqrt(square > 0 ? square : 0.0);
        q = c + root > 0 ? 2 * s / (c + root) : 1e300;
        double const under = 1 + a_ * q * q, fall = 1 - a_ * q * q;
        slope = square > 0 && c + root > 0 ? (q * q + under * under) / fall : -1;
        return;
      }
      case camera_kind::perspective:
        q = c > 0 ? s / c : 1e300, slope = c > 0 ? 1 / (c * c) : -1;
        return;
      default:
        q = theta, slope = 1;
    }
  }

  /// The direction that q is of.
  template <class F>
  GART_HD meridian_direction<F> back(F q) const {
    switch (kind_) {
      case camera_kind::fov: {
        sine_cosine const s = sine_cosine_of(fixed_double(static_cast<double>(q * F(a_))));
        return {F(static_cast<double>(s.sine)), F(b_) * F(static_cast<double>(s.cosine))};
      }
      case camera_kind::eucm: {
        F const square = q * q, inner = F(1) - F((2 * a_ - 1) * b_) * square;
        F const root = root_of(inner > F(0) ? inner : F(0));
        return {q, (F(1) - F(b_) * F(a_) * F(a_) * square) / (F(a_) * root + F(1 - a_))};
      }
      case camera_kind::division:
        return {q, F(1) + F(a_) * q * q};
      case camera_kind::perspective:
        return {q, F(1)};
      default: {
        sine_cosine const s = sine_cosine_of(fixed_double(static_cast<double>(q)));
        return {F(static_cast<double>(s.sine)), F(static_cast<double>(s.cosine))};
      }
    }
  }

  /// R and its derivative by q^2.
  template <class F>
  GART_HD void radial(F square, F& value, F& slope) const {
    F top = F(k_[5]), by_top = F(0);
    for (int i = 4; i >= 0; --i) by_top = by_top * square + top, top = top * square + F(k_[i]);
    by_top = by_top * square + top, top = top * square + F(1);
    F const under = F(1) + square * (F(d_[0]) + square * (F(d_[1]) + square * F(d_[2])));
    F const by_under = F(d_[0]) + square * (F(2 * d_[1]) + square * F(3 * d_[2]));
    value = top / under, slope = (by_top - value * by_under) / under;
  }

  /// A map of the plane at a point, and its derivatives there.
  template <class F>
  struct plane_map {
    F x, y, xx, xy, yx, yy;  ///< where it leads, then of that x by x and y, of that y by x and y
  };
  /// T at (x, y).
  template <class F>
  GART_HD plane_map<F> beside_at(F x, F y) const {
    F const p1 = F(p1_), p2 = F(p2_), s1 = F(s_[0]), s2 = F(s_[1]), s3 = F(s_[2]), s4 = F(s_[3]), two = F(2);
    F const r2 = x * x + y * y, across = two * x * y, first = s1 + s2 * r2, second = s3 + s4 * r2;
    F const by_first = two * (s1 + two * s2 * r2), by_second = two * (s3 + two * s4 * r2);
    return {p1 * across + p2 * (r2 + two * x * x) + first * r2,
            p2 * across + p1 * (r2 + two * y * y) + second * r2,
            two * p1 * y + F(6) * p2 * x + by_first * x,
            two * (p1 * x + p2 * y) + by_first * y,
            two * (p1 * x + p2 * y) + by_second * x,
            two * p2 * x + F(6) * p1 * y + by_second * y};
  }
  /// The image point of x, in units of the focal length about the principal point, and its derivatives.
  template <class F>
  GART_HD plane_map<F> image_of(F x, F y) const {
    F value, slope;
    radial(x * x + y * y, value, slope);
    F const bend = F(2) * slope, a = x * value, b = y * value;
    F const xx = value + bend * x * x, yy = value + bend * y * y, xy = bend * x * y;
    if (!beside_) return {a, b, xx, xy, xy, yy};
    plane_map<F> const t = after_ ? beside_at(a, b) : beside_at(x, y);
    if (!after_) return {a + t.x, b + t.y, xx + t.xx, xy + t.xy, xy + t.yx, yy + t.yy};
    return {a + t.x,
            b + t.y,
            xx + t.xx * xx + t.xy * xy,
            xy + t.xx * xy + t.xy * yy,
            xy + t.yx * xx + t.yy * xy,
            yy + t.yx * xy + t.yy * yy};
  }
  /// How large T_x and T_y are at most, within `reach` of the axis.
  GART_HD void most_beside(double reach, double& x, double& y) const {
    double const square = reach * reach, p1 = fabs(p1_), p2 = fabs(p2_);
    x = square * (p1 + 3 * p2 + fabs(s_[0]) + fabs(s_[1]) * square);
    y = square * (p2 + 3 * p1 + fabs(s_[2]) + fabs(s_[3]) * square);
  }
  /// How large its first and second derivatives are at most, within `reach` of the axis.
  GART_HD double steepest_beside(double reach) const {
    return reach * (6 * (fabs(p1_) + fabs(p2_)) + 2 * larger_of(0, 2) + 4 * larger_of(1, 3) * reach * reach);
  }
  /// The same, of the second.
  GART_HD double most_bent_beside(double reach) const {
    return 6 * (fabs(p1_) + fabs(p2_)) + 2 * larger_of(0, 2) + 12 * larger_of(1, 3) * reach * reach;
  }

  /// q of what R takes to r, between 0 and `most`, within which it grows: Newton's method between bounds.
  template <class F>
  GART_HD F unbent(F r, double most) const {
    F lo = F(0), hi = F(most), q = r < hi ? r : hi;
    for (int i = 0; i < 64; ++i) {
      F value, slope;
      radial(q * q, value, slope);
      F const error = q * value - r;
      if (error > F(0))
        hi = q;
      else
        lo = q;
      F next = q - error / (value + F(2) * q * q * slope);
      if (!(next > lo) || !(next < hi)) next = F(0.5) * (lo + hi);
      F const step = next - q, size = F(1e-15) * next;
      q = next;
      if (!(step > size) && !(-step > size)) break;
    }
    return q;
  }

  /// x of an image point (u, v), in units of the focal length; false where the lens gives none. most: of q; far: what R
  /// makes of it.
  template <class F>
  GART_HD bool undistorted(F u, F v, double most, double far, F& x, F& y) const {
    F a = u, b = v;  // what T adds to, or an estimate of it
    if (beside_ && after_) {
      for (int i = 0; i < newton_steps; ++i) {
        plane_map<F> t = beside_at(a, b);
        t.xx = F(1) + t.xx, t.yy = F(1) + t.yy;
        if (!step_to(a + t.x - u, b + t.y - v, t, a, b)) return false;
      }
      plane_map<F> const t = beside_at(a, b);
      if (!near_zero(a + t.x - u, b + t.y - v, u, v)) return false;
    }
    F const r = root_of(a * a + b * b);
    bool const within = !(r > F(far));
    if (!within && !(beside_ && !after_)) return false;
    F const q = unbent(within ? r : F(far), most), scale = r > F(0) ? q / r : F(1);
    x = a * scale, y = b * scale;
    if (!beside_ || after_) return true;
    for (int i = 0; i < newton_steps; ++i) {
      plane_map<F> const image = image_of(x, y);
      if (!step_to(image.x - u, image.y - v, image, x, y)) return false;
    }
    plane_map<F> const image = image_of(x, y);
    return near_zero(image.x - u, image.y - v, u, v) && !(x * x + y * y > F(most * most));
  }

 private:
  static constexpr int newton_steps = 8;

  GART_HD static double root_of(double a) { return sqrt(a); }
  GART_HD static fixed_double root_of(fixed_double a) { return square_root(a); }
  GART_HD double larger_of(int i, int j) const { return fabs(s_[i]) + fabs(s_[j]); }

  // A step of Newton's method by these derivatives; false where the lens folds.
  template <class F>
  GART_HD static bool step_to(F ex, F ey, plane_map<F> const& by, F& x, F& y) {
    F const det = by.xx * by.yy - by.xy * by.yx;
    if (!(det > F(1e-9))) return false;
    x = x - (ex * by.yy - ey * by.xy) / det, y = y - (ey * by.xx - ex * by.yx) / det;
    return true;
  }
  template <class F>
  GART_HD static bool near_zero(F ex, F ey, F u, F v) {
    return ex * ex + ey * ey < F(1e-16) * (F(1) + u * u + v * v);
  }

  camera_kind kind_ = camera_kind::perspective;
  bool after_ = false, beside_ = false;
  double a_ = 0, b_ = 0;  // of the kind
  double k_[6] = {}, d_[3] = {};
  double p1_ = 0, p2_ = 0, s_[4] = {};
};

}}  // namespace gart::GART_ISA
