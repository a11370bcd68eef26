#pragma once
/// \file
/// A camera as a program fills it in and files hold it: which model it is and that model's parameters. Models in
/// camera/ give them their meaning (camera/model.hpp); camera/models.hpp goes from here to there.
///
/// Axes are OpenCV's: x right, y down, z forward. Pixel (0, 0) is the top-left corner of the image, the ray of pixel
/// (i, j) goes through (i + 0.5, j + 0.5).

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

#include <string>

namespace gart {

/// The models. The models between perspective and equirectangular are camera/radial_lens.hpp. Each has its own distance
/// of an image point from the principal point by the angle with the axis.
enum class camera_kind {
  perspective,      ///< camera/pinhole.hpp; with k1, k2, p1 or p2 camera/opencv.hpp; with more camera/radial_lens.hpp
  fisheye,          ///< the distance is the angle: Kannala and Brandt's, COLMAP's and OpenCV's fisheyes
  fisheye624,       ///< the same, tangential terms after the radial ones: Project Aria's, COLMAP's
                    ///< RAD_TAN_THIN_PRISM_FISHEYE
  fov,              ///< Devernay and Faugeras', by the angle omega
  eucm,             ///< the enhanced unified model, by alpha and beta
  division,         ///< Fitzgibbon's, by k1
  equirectangular,  ///< the whole sphere, camera/equirectangular.hpp
  orthographic,     ///< parallel rays, camera/orthographic.hpp; focal lengths are pixels a world unit
};

/// When the lines of an image are exposed: all at once, or one after another while the camera moves
/// (camera/rolling_shutter.hpp).
enum class shutter_kind { global, top_to_bottom, left_to_right, bottom_to_top, right_to_left };

/// Coefficients of a lens; none is used where all are zero.
struct distortion {
  float k1 = 0, k2 = 0, p1 = 0, p2 = 0;  ///< radial, then tangential
  float k3 = 0, k4 = 0, k5 = 0, k6 = 0;  ///< radial, of higher powers
  float d1 = 0, d2 = 0, d3 = 0;          ///< what the radial part is divided by: FULL_OPENCV's k4, k5 and k6
  float s1 = 0, s2 = 0, s3 = 0, s4 = 0;  ///< thin prism: r^2 and r^4 in x, then in y
  float omega = 0;                       ///< of camera_kind::fov, radians
  float alpha = 0, beta = 1;             ///< of camera_kind::eucm
  /// Whether any is not zero.
  GART_HD bool any() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || more(); }
  /// Whether there is more than k1, k2, p1 and p2.
  GART_HD bool more() const {
    return k3 != 0 || k4 != 0 || k5 != 0 || k6 != 0 || d1 != 0 || d2 != 0 || d3 != 0 || s1 != 0 || s2 != 0 || s3 != 0 ||
           s4 != 0;
  }
};

/// A view's camera.
struct camera {
  int width = 0, height = 0;             ///< pixels
  float fx = 0, fy = 0, cx = 0, cy = 0;  ///< focal lengths and principal point, pixels; equirectangular: none
  distortion lens;                       ///< none where zero
  mat3 rotation{1.0f};                   ///< camera to world; columns are the camera's axes in the world
  vec3d position{0.0};                   ///< the centre in the world, in double: everything else is relative to it
  camera_kind kind = camera_kind::perspective;  ///< its model
  shutter_kind shutter = shutter_kind::global;  ///< where the pose is that of the middle of the read-out
  /// The camera's motion, in its own axes, while its shutter goes from one border of the image to the other.
  vec3 travel{0.0f};
  vec3 turn{0.0f};  ///< the same of its rotation: the axis times the angle, radians
};

/// A camera of a file.
struct named_camera {
  std::string name;  ///< unique in the file
  camera view;       ///< its pose, lens and size
};

/// The fault of a camera and its remedy; null where there is none.
struct camera_fault {
  char const* what = nullptr;    ///< null: nothing
  char const* remedy = nullptr;  ///< what to correct
};

}  // namespace gart

namespace gart { inline namespace GART_ISA {

/// Across and down, in the middle of the image: the focal lengths, or what the sphere has in their place. Of parallel
/// rays pixels a world unit.
inline vec2 pixels_per_radian(camera const& c) {
  if (c.kind != camera_kind::equirectangular) return {c.fx, c.fy};
  return {static_cast<float>(c.width) / 6.2831853f, static_cast<float>(c.height) / 3.1415927f};
}

/// The same camera for an image of another size: intrinsics scale per axis.
inline camera resized(camera c, int width, int height) {
  float const sx = static_cast<float>(width) / static_cast<float>(c.width);
  float const sy = static_cast<float>(height) / static_cast<float>(c.height);
  c.fx *= sx, c.cx *= sx, c.fy *= sy, c.cy *= sy;
  c.width = width, c.height = height;
  return c;
}

}}  // namespace gart::GART_ISA
