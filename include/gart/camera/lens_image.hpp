#pragma once
/// \file
/// A lens of any curve (camera/lens_curve.hpp) as an image. It tells where a direction lies on it, up to which angle,
/// and how fast it changes there. Boxes follow from these (camera/lens_bounds.hpp). Tables of derivatives are running
/// maxima by the angle with the axis, made on the host in milliseconds: 1.5 KiB.

#include <gart/camera/lens_curve.hpp>
#include <gart/math/glm.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// Host side made, trivially copyable; in double, in units of the focal lengths where no pixels are said.
class lens_image {
 public:
  /// A point of the image, and the angle with the axis of the direction that it is of.
  struct place {
    double x, y, theta;  ///< in units of the focal lengths; radians
  };
  /// Of an image coordinate along any line of sight that turns, up to some angle with the axis, at most.
  struct changes_up_to {
    double first, second;  ///< derivatives by the angle
    double third;          ///< without the tangential terms,
    double second_beside;  ///< and the second of these alone
  };

  lens_image() = default;
  /// Of a camera's size, focal lengths and principal point.
  lens_image(lens_curve const& curve, double fx, double fy, double cx, double cy, int width, int height)
      : curve_(curve), fx_(fx), fy_(fy), cx_(cx), cy_(cy), width_(width), height_(height) {
    find_last();
    tabulate();
  }

  double last() const { return last_; }               ///< the largest angle with the axis that a ray may have
  double farthest_q() const { return last_q_; }       ///< its q
  double farthest_r() const { return last_r_; }       ///< what the radial terms make of that
  lens_curve const& curve() const { return curve_; }  ///< of the lens

  /// The distance from the axis that the curve and the radial terms give, and its derivative by the angle.
  GART_HD void distance_at(double theta, double& r, double& slope) const {
    double q, by_theta, value, by_square;
    curve_.curve(theta, q, by_theta);
    curve_.radial(q * q, value, by_square);
    r = q * value, slope = by_theta * (value + 2 * q * q * by_square);
  }

  /// The values of the curve alone.
  GART_HD double q_at(double theta) const {
    double q, ignored;
    curve_.curve(theta, q, ignored);
    return q;
  }

  /// Where a direction in the camera's axes, of any length, is on the image.
  GART_HD place place_of(vec3d const& d) const {
    double const across = sqrt(d.x * d.x + d.y * d.y), theta = atan2(across, d.z);
    double q, ignored, value;
    curve_.curve(theta, q, ignored);
    curve_.radial(q * q, value, ignored);
    double const x = across > 0 ? q * d.x / across : 0, y = across > 0 ? q * d.y / across : 0;
    place out{x * value, y * value, theta};
    if (curve_.beside()) {
      auto const t = curve_.after() ? curve_.beside_at(out.x, out.y) : curve_.beside_at(x, y);
      out.x += t.x, out.y += t.y;
    }
    return out;
  }
  /// The same in pixels.
  void image_of(vec3d const& d, double& u, double& v) const {
    place const p = place_of(d);
    u = fx_ * p.x + cx_, v = fy_ * p.y + cy_;
  }

  GART_HD double end() const { return end_; }  ///< the angle up to which changes() are known
  /// The angle up to which both image coordinates have a gradient everywhere. Neither then has its maximum inside a
  /// region.
  GART_HD double unfolded() const { return unfolded_; }
  /// Up to an angle that is less than end().
  GART_HD changes_up_to changes(double theta) const {
    int const at = static_cast<int>(theta / end_ * cells), cell = at < cells ? at : cells - 1;
    return {first_[cell], bend_[cell], twist_[cell], beside_[cell]};
  }

 protected:
  lens_curve curve_;                           ///< of the lens
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;   ///< pixels
  int width_ = 0, height_ = 0;                 ///< pixels
  double last_ = 0, last_q_ = 0, last_r_ = 0;  ///< as said above

 private:
  static constexpr int cells = 96;

  // The last angle: where the distance still grows, and no farther than the image needs.
  void find_last() {
    double need = 0;
    for (double const u : {-cx_ / fx_, (width_ - cx_) / fx_})
      for (double const v : {-cy_ / fy_, (height_ - cy_) / fy_}) need = std::fmax(need, std::hypot(u, v));
    need *= 1.05;
    if (curve_.beside()) need += 2 * curve_.steepest_beside(need) * need;
    constexpr int steps = 2048;
    constexpr double most = 3.1415926;
    auto const grows = [&](double theta) {
      double r, slope;
      distance_at(theta, r, slope);
      return slope > 1e-6 && std::isfinite(r) && r < need;
    };
    double lo = 0, hi = most;
    for (int i = 1; i <= steps; ++i) {
      double const theta = most * i / steps;
      if (!grows(theta)) {
        hi = theta;
        break;
      }
      lo = theta;
    }
    for (int i = 0; i < 50 && hi < most; ++i) {
      double const middle = 0.5 * (lo + hi);
      (grows(middle) ? lo : hi) = middle;
    }
    last_ = hi < most ? lo : most;
    double ignored;
    distance_at(last_, last_r_, ignored);
    last_q_ = q_at(last_);
  }

  void tabulate() {
    // Beyond the last angle, the end of the curve may still bound the visible part of an ellipsoid.
    end_ = last_;
    for (double const step = 1.0 / 64; end_ + step < last_ + 1 && end_ + step < 3.12; end_ += step) {
      double r, slope;
      distance_at(end_ + step, r, slope);
      if (!(std::isfinite(r) && std::fabs(r) < 2 * last_r_ + 10 && std::fabs(slope) < 100 * (1 + last_r_))) break;
    }
    end_ = end_ > 3.12 ? 3.12 : end_ > 1e-3 ? end_ : 1e-3;
    unfolded_ = without_fold();
    double first = 0, bend = 0, twist = 0, beside = 0;
    constexpr int samples = 4;
    for (int cell = 0; cell < cells; ++cell) {
      for (int i = 0; i <= samples; ++i) {
        double const theta = end_ * (cell + i / double{samples}) / cells;
        differences const own = differences_at(theta, [&](double at) {
          double r, ignored;
          distance_at(at, r, ignored);
          return r;
        });
        bend = std::fmax(bend, own.second), twist = std::fmax(twist, own.third);
        if (!curve_.beside()) {
          first = std::fmax(first, own.first);
          continue;
        }
        differences const of_q = curve_.after() ? own : differences_at(theta, [&](double at) { return q_at(at); });
        double const reach = of_q.value;
        first = std::fmax(first, own.first + curve_.steepest_beside(reach) * of_q.first);
        beside = std::fmax(beside, curve_.steepest_beside(reach) * of_q.second +
                                       curve_.most_bent_beside(reach) * of_q.first * of_q.first);
      }
      // A tenth for the curve between samples.
      beside_[cell] = static_cast<float>(1.1 * beside);
      first_[cell] = static_cast<float>(1.1 * first + 1e-6);
      bend_[cell] = static_cast<float>(1.1 * (bend + beside) + 1e-6), twist_[cell] = static_cast<float>(1.1 * twist);
    }
  }

  double without_fold() const {
    constexpr int directions = 24;
    constexpr double h = 1e-5;
    for (int i = 1; i <= 4 * cells; ++i) {
      double const theta = end_ * i / (4 * cells);
      double r, slope;
      distance_at(theta, r, slope);
      bool grows = slope > 1e-6 && r > 0;
      for (int k = 0; k < directions && grows && curve_.beside(); ++k) {
        double const phi = 2 * 3.141592653589793 * k / directions;
        auto const at = [&](double t, double f) {
          return place_of({std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t)});
        };
        place const a = at(theta + h, phi), b = at(theta - h, phi), c = at(theta, phi + h), d = at(theta, phi - h);
        grows = (a.x - b.x) * (c.y - d.y) - (a.y - b.y) * (c.x - d.x) > 0;
      }
      if (!grows) return end_ * (i - 1) / (4 * cells);
    }
    return end_;
  }

  // Bounds of the derivatives of an image coordinate distance(theta) cos(phi), whatever phi. They are along a line of
  // sight that turns from that angle in any direction.
  struct differences {
    double value = 0, first = 0, second = 0, third = 0;
  };
  template <class F>
  static differences differences_at(double theta, F const& distance) {
    constexpr int directions = 12;
    double const h = 0.004 * std::fmin(1.0, 10 * (3.1415926 - theta));
    differences out;
    out.value = distance(theta);
    for (int k = 0; k <= directions; ++k) {
      double const psi = 3.141592653589793 * k / directions, c = std::cos(psi), s = std::sin(psi);
      double x[5], y[5];
      for (int i = -2; i <= 2; ++i) {
        double const ct = std::cos(i * h), st = std::sin(i * h), sine = std::sin(theta), cosine = std::cos(theta);
        double const dx = ct * sine + st * c * cosine, dy = st * s, dz = ct * cosine - st * c * sine;
        double const across = std::hypot(dx, dy), r = distance(std::atan2(across, dz));
        x[i + 2] = across > 0 ? r * dx / across : 0, y[i + 2] = across > 0 ? r * dy / across : 0;
      }
      auto const length = [](double a, double b) { return std::hypot(a, b); };
      out.first = std::fmax(out.first, length(x[3] - x[1], y[3] - y[1]) / (2 * h));
      out.second = std::fmax(out.second, length(x[3] - 2 * x[2] + x[1], y[3] - 2 * y[2] + y[1]) / (h * h));
      out.third = std::fmax(
          out.third, length(x[4] - 2 * x[3] + 2 * x[1] - x[0], y[4] - 2 * y[3] + 2 * y[1] - y[0]) / (2 * h * h * h));
    }
    return out;
  }

  double end_ = 1, unfolded_ = 0;
  float first_[cells] = {}, bend_[cells] = {}, twist_[cells] = {}, beside_[cells] = {};
};

}}  // namespace gart::GART_ISA
