#pragma once
/// \file
/// The camera models. visit_camera(view, f), which calls f with the model, is the one place that turns a run-time
/// camera into its model. A view that is a model already is passed on (camera/model.hpp).
///
/// Errors: require_camera throws invalid_argument for a camera by which no ray can be cast; everything that renders
/// calls it.

#include <gart/camera/equirectangular.hpp>
#include <gart/camera/opencv.hpp>
#include <gart/camera/orthographic.hpp>
#include <gart/camera/pinhole.hpp>
#include <gart/camera/radial_lens.hpp>
#include <gart/camera/rolling_shutter.hpp>

namespace gart { inline namespace GART_ISA {

/// Calls f with the model that the camera is of, and returns what f does. A rolling shutter has one lens for all that
/// project slopes and for fisheyes.
template <class F>
decltype(auto) visit_camera(camera const& c, F&& f) {
  if (c.kind == camera_kind::orthographic) return f(orthographic(c));
  if (c.shutter != shutter_kind::global)
    return c.kind == camera_kind::equirectangular ? f(rolling_shutter<equirectangular>(c))
                                                  : f(rolling_shutter<radial_lens>(c));
  switch (c.kind) {
    case camera_kind::perspective:
      break;
    case camera_kind::equirectangular:
      return f(equirectangular(c));
    default:
      return f(radial_lens(c));
  }
  return !c.lens.any() ? f(pinhole(c)) : c.lens.more() ? f(radial_lens(c)) : f(opencv(c));
}

/// A camera by which no ray can be cast.
inline camera_fault fault_of(camera const& c) {
  return visit_camera(c, [](auto const& model) { return model.fault(); });
}

/// Throws invalid_argument for a camera by which no ray can be cast.
inline void require_camera(camera const& c) { refuse_camera(fault_of(c)); }

/// The ray through an image point: its unit direction in the world, its origin relative to the camera's position. Host
/// side.
inline ray ray_through(camera const& c, float u, float v) {
  return visit_camera(c, [&](auto const& model) -> ray {
    auto const r = model.ray(u, v);
    return {origin_of(r), r.direction};
  });
}
/// Its direction alone.
inline vec3 ray_direction(camera const& c, float u, float v) { return ray_through(c, u, v).direction; }

}}  // namespace gart::GART_ISA
