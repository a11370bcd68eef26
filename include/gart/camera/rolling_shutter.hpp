#pragma once
/// \file
/// A lens whose image is exposed line by line while the camera moves (camera/shutter.hpp). Each row, or column, has a
/// pose, and its rays begin there. Any lens with one centre.
///
/// Box: while some lines are exposed, the ellipsoid moves within one larger ellipsoid in the camera's axes. The lens
/// bounds the larger one. Only the lines of the lens's box can hit it, and the same holds again over these. Each round
/// is conservative, and the lines of a small ellipsoid are few. Let c(s) be its centre and A(s) its axes in the
/// camera's axes, at times within h of s. Let q = h c'(s). Let e be the largest other change of c and A, by rotation
/// and second order. Then
///   C' = (1 + k2) [(1 + k1) A A^T + (1 + 1/k1) e^2] + (1 + 1/k2) q q^T,
/// the outer ellipsoid of a Minkowski sum, for any k1, k2 > 0.

#include <gart/camera/equirectangular.hpp>
#include <gart/camera/shutter.hpp>

namespace gart { inline namespace GART_ISA {

/// Boxes of ellipsoids. Bounds: of the lens that stands still.
template <class Bounds>
struct rolling_bounds {
  Bounds still;            ///< at the middle of the read-out
  shutter_lines_of lines;  ///< when they are exposed
  vec3d travel, turn;      ///< over the whole image, in world axes
  int across;              ///< pixels of a line
  float near;              ///< of hits

  /// The pixels that can hit it, and its near depth; empty where none can.
  GART_HD footprint operator()(ellipsoid const& e) const {
    double first = 0.5, end = lines.count - 0.5;  // the middles of lines that can hit it
    footprint out;
    GART_NO_UNROLL
    for (int round = 0; round < most_rounds; ++round) {
      ellipsoid const larger = over(e, first, end);
      footprint const f = around_camera(larger) ? everything(larger, first, end) : still(larger);
      if (f.box.empty()) return {};
      float const depth = f.depth > out.depth ? f.depth : out.depth;
      if (round == 0 || f.box.area() < out.box.area()) out = f;
      out.depth = depth;
      double lo = lines.columns ? f.box.x0 : f.box.y0, hi = lines.columns ? f.box.x1 : f.box.y1;
      if (lines.columns && f.seam) lo = 0, hi = lines.count;
      lo += 0.5, hi -= 0.5;
      lo = lo > first ? lo : first, hi = hi < end ? hi : end;
      if (hi < lo) return {};
      bool const fewer = hi - lo < 0.9 * (end - first);
      first = lo, end = hi;
      if (!fewer) break;
    }
    return out;
  }

 private:
  static constexpr int most_rounds = 8;

  // Whether the camera is within what `over` returns, whose axes are a triangle's. Where hits lie in front of such a
  // camera depends on the ellipsoid itself. It says nothing of a smaller one inside.
  GART_HD static bool around_camera(ellipsoid const& e) {
    double const x = e.center.x / e.axes[0].x, y = (e.center.y - e.axes[0].y * x) / e.axes[1].y,
                 z = (e.center.z - e.axes[0].z * x - e.axes[1].z * y) / e.axes[2].z;
    return !(x * x + y * y + z * z > 1 + 1e-6);
  }
  GART_HD footprint everything(ellipsoid const& e, double first, double end) const {
    footprint out;
    out.depth = least_distance(e, near);
    u16 const lo = static_cast<u16>(first), hi = static_cast<u16>(end + 0.5);
    out.box =
        lines.columns ? pixel_box{lo, 0, hi, static_cast<u16>(across)} : pixel_box{0, lo, static_cast<u16>(across), hi};
    return out;
  }

  // All that the ellipsoid covers while the lines between these places are exposed, in the axes of mid read-out.
  GART_HD ellipsoid over(ellipsoid const& e, double first, double end) const {
    double s = lines.template time_at<double>(0.5 * (first + end), 0.5 * (first + end));
    double const h = 0.5 * (end - first) / lines.count, speed = glm::length(travel), spin = glm::length(turn);
    vec3d const arm = e.center - travel * s;
    mat3d const back = turn_of(turn * -s);
    ellipsoid out;
    out.center = back * arm;
    mat3d const a = back * e.axes;
    vec3d const q = back * (glm::cross(turn, arm) + travel) * h;  // but for its sign
    double c[3][3];
    double trace = 0, longest2 = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) c[i][j] = a[0][i] * a[0][j] + a[1][i] * a[1][j] + a[2][i] * a[2][j];
    for (int k = 0; k < 3; ++k) {
      double const own = glm::dot(e.axes[k], e.axes[k]);
      trace += c[k][k], longest2 = own > longest2 ? own : longest2;
    }
    // For axes that are not orthogonal to the last digit the longest axis is no bound.
    double const longest = sqrt(longest2) * (1 + 1e-5);
    double const far = glm::length(e.center) + speed;
    double const rest = 0.5 * h * h * (spin * spin * far + 2 * spin * speed) + h * spin * longest +
                        4 * rounding_of_hits * (far + longest);
    // Widths across the direction it is seen in.
    double const distance = glm::length(out.center), nearness = distance > 0 ? 1 / distance : 0;
    vec3d const d = out.center * nearness;
    double along = 0;
    for (int k = 0; k < 3; ++k) along += glm::dot(a[k], d) * glm::dot(a[k], d);
    double const tiny = 1e-9 * (far + longest) + 1e-30;
    double const width2 = 0.5 * (trace - along), width = sqrt(width2 > 0 ? width2 : 0.0) + tiny;
    double const q_along = glm::dot(q, d), q2 = glm::dot(q, q), q_across2 = q2 - q_along * q_along;
    double const k1 = rest / width;
    double const k2 = (sqrt(q_across2 > 0 ? q_across2 : 0.0) + 0.05 * sqrt(q2) + tiny) / (width + rest);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double const inner = (1 + k1) * c[i][j] + (i == j ? (1 + 1 / k1) * rest * rest : 0.0);
        c[i][j] = (1 + k2) * inner + (1 + 1 / k2) * q[i] * q[j];
      }
    // Its axes: a root of C', by Cholesky.
    double const l00 = sqrt(c[0][0]), l10 = c[1][0] / l00, l20 = c[2][0] / l00;
    double const r11 = c[1][1] - l10 * l10, l11 = sqrt(r11 > tiny * tiny ? r11 : tiny * tiny);
    double const l21 = (c[2][1] - l20 * l10) / l11, r22 = c[2][2] - l20 * l20 - l21 * l21;
    out.axes[0] = vec3d(l00, l10, l20), out.axes[1] = vec3d(0, l11, l21);
    out.axes[2] = vec3d(0, 0, sqrt(r22 > tiny * tiny ? r22 : tiny * tiny));
    return out;
  }
};

/// The model: a lens (radial_lens, equirectangular) that moves.
template <class Lens>
struct rolling_shutter : camera_base {
  Lens lens;               ///< at the middle of the read-out
  shutter_lines_of lines;  ///< when they are exposed
  vec3 travel{0.0f};       ///< over the whole image, in the camera's axes
  vec3 turn{0.0f};         ///< the same: the axis times the angle

  rolling_shutter() = default;
  /// From the run-time camera. Host side.
  explicit rolling_shutter(camera const& c) : camera_base(c), lens(c), lines(c), travel(c.travel), turn(c.turn) {}

  /// Through the image point (u, v), in pixels; a direction of zeros where the lens gives none.
  GART_HD gart::ray ray(float u, float v) const {
    using number = fixed_double;
    gart::ray out{vec3(0.0f), vec3(0.0f)};
    fixed_direction const d = lens.direction_in_camera(u, v);
    number const s = lines.template time_at<number>(u, v);
    number t[3];
    for (int k = 0; k < 3; ++k) t[k] = s * number(travel[k]);
    for (int k = 0; k < 3; ++k)
      out.origin[k] = static_cast<float>(number(lens.rotation[0][k]) * t[0] + number(lens.rotation[1][k]) * t[1] +
                                         number(lens.rotation[2][k]) * t[2]);
    if (!d.seen) return out;
    number const w[3] = {number(turn.x), number(turn.y), number(turn.z)};
    number const angle2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(angle2 > 1e-24)) {
      out.direction = unit_in_world(lens.rotation, d.x, d.y, d.z);
      return out;
    }
    number const angle = square_root(angle2);
    sine_cosine const by = sine_cosine_of(s * angle);
    vec3_of<number> const turned =
        turned_about<number>({w[0] / angle, w[1] / angle, w[2] / angle}, by.sine, by.cosine, {d.x, d.y, d.z});
    out.direction = unit_in_world(lens.rotation, turned.x, turned.y, turned.z);
    return out;
  }

  /// Of a lens that has them: focal lengths and principal point.
  intrinsics focal() const requires focal_camera<Lens> { return lens.focal(); }
  /// The same: how rays change with their image points.
  lens_slopes slopes() const requires focal_camera<Lens> { return lens.slopes().turning(lines, turn); }

  /// For hits at t > near.
  auto bounds(float near) const {
    using still = decltype(lens.bounds(near));
    mat3d const axes(lens.rotation);
    return rolling_bounds<still>{
        lens.bounds(near), lines, axes * vec3d(travel), axes * vec3d(turn), lines.columns ? height : width, near};
  }

  /// Of so many pixels, as at the middle of the read-out.
  axial_filter filter(float pixels) const { return lens.filter(pixels); }

  /// The lens', or that of the motion.
  camera_fault fault() const {
    for (int k = 0; k < 3; ++k)
      if (!is_finite(travel[k]) || !is_finite(turn[k]))
        return {"the camera's motion is not finite", "correct the poses of its first and last line"};
    if (!(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z < 9.0f))
      return {"the camera turns by half a turn or more in one image", "correct the poses of its first and last line"};
    return lens.fault();
  }
  /// Whether the lens is; the motion is not looked at.
  bool one_to_one() const { return lens.one_to_one(); }
};

static_assert(focal_camera<rolling_shutter<radial_lens>> && camera_model<rolling_shutter<equirectangular>>);

}}  // namespace gart::GART_ISA
