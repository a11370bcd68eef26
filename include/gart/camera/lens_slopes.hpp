#pragma once
/// \file
/// How a ray changes as its image point moves. Learning a focal length or a principal point needs this. A camera with
/// slopes casts its rays by x = (u - cx) / fx and y = (v - cy) / fy alone. With the ray's derivatives by x and y,
///   d ray / d cx = -(d ray / d x) / fx,   d ray / d fx = -x (d ray / d x) / fx,   and y likewise.
/// A model says so by a member (camera/model.hpp)
///   slopes() const: a trivially copyable ray_slopes operator()(float u, float v, vec3 direction) const
/// of the image point and its ray's direction in the world. lens_slopes serves all whose lens is a curve of the angle
/// with the axis, the pinhole and OpenCV's too. It inverts the derivative of the lens, so no ray is cast again.

#include <gart/camera/lens_curve.hpp>
#include <gart/camera/model.hpp>
#include <gart/camera/shutter.hpp>

namespace gart { inline namespace GART_ISA {

/// Focal lengths and principal point, pixels; of a camera of parallel rays pixels a world unit.
struct intrinsics {
  float fx = 0, fy = 0, cx = 0, cy = 0;  ///< as camera has them
};

/// The members of models with focal lengths and a principal point.
struct focal_base : camera_base {
  float fx = 0, fy = 0, cx = 0, cy = 0;  ///< as intrinsics
  mat3 rotation{1.0f};                   ///< camera to world; columns are the camera's axes

  /// Focal lengths and principal point.
  intrinsics focal() const { return {fx, fy, cx, cy}; }

 protected:
  ///@{
  /// From the run-time camera.
  focal_base() = default;
  GART_HD explicit focal_base(camera const& c)
      : camera_base(c), fx(c.fx), fy(c.fy), cx(c.cx), cy(c.cy), rotation(c.rotation) {}
  ///@}
  /// Size, focal lengths or principal point.
  camera_fault image_fault() const {
    if (camera_fault const size = size_fault(*this); size.what) return size;
    if (!(fx > 0 && fy > 0 && is_finite(fx) && is_finite(fy)))
      return {"the focal length is not a positive number", "correct fx and fy"};
    if (!(is_finite(cx) && is_finite(cy))) return {"the principal point is not finite", "correct cx and cy"};
    return {};
  }
};

/// Derivatives of a ray, in world axes.
struct ray_slopes {
  vec3 direction_x{0.0f}, direction_y{0.0f};  ///< of the unit direction
  vec3 origin_x{0.0f}, origin_y{0.0f};        ///< of the origin
};

/// A model whose rays follow from focal lengths and a principal point.
template <class M>
concept focal_camera = camera_model<M> && requires(M const& m, float value, vec3 const& direction) {
  { m.slopes()(value, value, direction) } -> std::same_as<ray_slopes>;
  { m.focal() } -> std::same_as<intrinsics>;
};

/// Of a lens that is a curve, in double.
class lens_slopes {
 public:
  /// Rotation: camera to world.
  GART_HD lens_slopes(camera_kind kind, distortion const& lens, mat3 const& rotation)
      : curve_(kind, lens), rotation_(rotation) {}
  /// The same, of a camera that turns in its own axes while its lines are read.
  GART_HD lens_slopes turning(shutter_lines_of const& lines, vec3 const& turn) const {
    lens_slopes out = *this;
    out.lines_ = lines, out.turn_ = vec3d(turn);
    return out;
  }

  /// Zeros where the lens folds, or there is no ray.
  GART_HD ray_slopes operator()(float u, float v, vec3 const& direction) const {
    mat3d axes(rotation_);
    if (turn_.x != 0 || turn_.y != 0 || turn_.z != 0)
      axes = axes * turn_of(turn_ * lines_.time_at<double>(double{u}, double{v}));
    vec3d d(0.0);
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j) d[k] += axes[k][j] * double{direction[j]};
    double const sine = sqrt(d.x * d.x + d.y * d.y), cosine = d.z;
    if (!(sine + fabs(cosine) > 0)) return {};
    double q, slope;
    curve_.curve(atan2(sine, cosine), q, slope);
    if (!(slope > 0 && q < 1e100)) return {};
    // Along the meridian and across it.
    bool const off_axis = sine > 1e-12;
    double const cx = off_axis ? d.x / sine : 1.0, cy = off_axis ? d.y / sine : 0.0;
    double const across = off_axis ? sine / q : 1 / slope;
    vec3d const outwards = vec3d(cosine * cx, cosine * cy, -sine) / slope, around(-cy * across, cx * across, 0);
    auto const image = curve_.image_of(q * cx, q * cy);
    double const det = image.xx * image.yy - image.xy * image.yx;
    if (!(det > 1e-9)) return {};
    vec3d const by_x = outwards * cx - around * cy, by_y = outwards * cy + around * cx;
    return {vec3(axes * ((by_x * image.yy - by_y * image.yx) / det)),
            vec3(axes * ((by_y * image.xx - by_x * image.xy) / det))};
  }

 private:
  lens_curve curve_;
  mat3 rotation_;
  shutter_lines_of lines_;
  vec3d turn_{0.0};
};

}}  // namespace gart::GART_ISA
