#pragma once
/// \file
/// The camera seam: what gart asks of a camera model. A model is a small struct of parameters in one header. Everything
/// else follows from its members: tracers, tile lists, footprints, the backward passes and antialiasing know no model
/// by name. camera/models.hpp goes from the run-time camera (scene/camera.hpp) to its model.
///
/// A model derives from camera_base; one with focal lengths from focal_base (camera/lens_slopes.hpp). With F float or,
/// on hosts, lanes it has:
///   template <class F> primary_ray_of<F> ray(F u, F v) const
///     The ray through the image point (u, v), in pixels, with its unit direction in world axes. It decides hits, so
///     its arithmetic is fixed (math/arith.hpp): the same bits for a lane as for one point. A model without arithmetic
///     for lanes calls each_lane. A direction of zeros means that there is no ray: it hits nothing. A camera whose rays
///     do not share one point returns `ray` for a float, whose origin is relative to `position`. Tracers, compositing
///     and gradients take such rays too (origin_rays).
///   bounds(float near) const
///     Host side: a trivially copyable footprint operator()(ellipsoid const&) const for kernels. It gives the box of
///     all pixels whose rays can hit the ellipsoid at t > near, and a lower bound of these hits' depths. It is
///     conservative for rays in float: math/footprint.hpp says by how much to widen. Where few ellipsoids take far
///     longer than the rest it may also have footprint narrow(ellipsoid const&, bool& wide) const. That sets `wide` for
///     these instead, and kernels take them in a launch of their own (tiles/footprints.hpp).
///   ray_depth depth() const
///     What those depths are measured along (camera/ray_depth.hpp). camera_base has the distance along the ray.
///   filter(float pixels) const
///     Host side: how far so many pixels reach at a point relative to `position`. That is pixels x the root of a
///     pixel's solid angle x distance. It is trivially copyable. It has float sigma_at(vec3), filter_at at(vec3) with
///     its change, and vec3 from_camera(gaussian_parameters). Beside the image it goes on as at the image's nearest
///     border.
///   camera_fault fault() const
///     What no ray can be cast by.
///   bool one_to_one() const
///     Host side: whether no two pixels see one direction, and each sees one. Footprints need it. camera_base has true.
///   slopes() const, intrinsics focal() const
///     How the rays of a camera with focal lengths and a principal point change with their image points
///     (camera/lens_slopes.hpp). By these a lens is learned.
///
/// Which pixels of a tile come how near an ellipsoid needs no member: tiles/tile_planes.hpp has it from the rays.
/// Kernels cast a pinhole's rays themselves; those of other models are cast once a view (camera/pixel_rays.hpp). Rays
/// without one centre are walked one by one, not in packets or warps.

#include <gart/camera/ray_depth.hpp>
#include <gart/core/error.hpp>
#include <gart/math/footprint.hpp>
#include <gart/math/lanes.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/math/widened.hpp>
#include <gart/scene/camera.hpp>

#include <concepts>
#include <string>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// The members that all models have.
struct camera_base {
  int width = 0, height = 0;  ///< pixels
  vec3d position{0.0};        ///< the frame's origin: all else is relative to it

  /// Distance along the ray.
  GART_HD ray_depth depth() const { return {}; }
  /// True: a model that may see one direction twice says otherwise.
  bool one_to_one() const { return true; }

 protected:
  ///@{
  /// Size and position.
  camera_base() = default;
  GART_HD explicit camera_base(camera const& c) : width(c.width), height(c.height), position(c.position) {}
  ///@}
};

namespace detail {

template <class R, class F>
concept camera_ray = std::same_as<R, primary_ray_of<F>> ||(std::same_as<F, float>&& std::same_as<R, ray>);

template <class B>
concept camera_bounds = std::is_trivially_copyable_v<B> && requires(B const& bounds, ellipsoid const& e) {
  { bounds(e) } -> std::same_as<footprint>;
};

template <class B>
concept staged_bounds = camera_bounds<B> && requires(B const& bounds, ellipsoid const& e, bool& wide) {
  { bounds.narrow(e, wide) } -> std::same_as<footprint>;
};

template <class T>
concept camera_filter = std::is_trivially_copyable_v<T> &&
    requires(T const& filter, vec3 const& m, gaussian_parameters const& g) {
  { filter.sigma_at(m) } -> std::same_as<float>;
  { filter.at(m) } -> std::same_as<filter_at>;
  { filter.from_camera(g) } -> std::same_as<vec3>;
};

}  // namespace detail

/// A model: it has the members that are listed above.
template <class M>
concept camera_model = std::derived_from<M, camera_base> && std::is_trivially_copyable_v<M> &&
    requires(M const& m, float value) {
  { m.ray(value, value) } -> detail::camera_ray<float>;
  { m.bounds(value) } -> detail::camera_bounds;
  { m.depth() } -> std::same_as<ray_depth>;
  { m.filter(value) } -> detail::camera_filter;
  { m.fault() } -> std::same_as<camera_fault>;
  { m.one_to_one() } -> std::same_as<bool>;
};

/// All rays begin at `position`.
template <class M>
concept central_camera = camera_model<M> && requires(M const& m, float value) {
  { m.ray(value, value) } -> std::same_as<primary_ray>;
#if !defined(__CUDACC__)
  { m.ray(lanes(value), lanes(value)) } -> std::same_as<primary_ray_of<lanes>>;
#endif
};

/// A model is its own: what takes a view takes a camera or a model.
template <camera_model M, class F>
decltype(auto) visit_camera(M const& model, F&& f) {
  return f(model);
}

/// A camera by which no ray can be cast.
template <camera_model M>
camera_fault fault_of(M const& model) {
  return model.fault();
}

/// Throws invalid_argument where there is a fault.
inline void refuse_camera(camera_fault const& fault) {
  if (fault.what) throw invalid_argument(std::string("camera: ") + fault.what + " (" + fault.remedy + ")");
}

/// Throws invalid_argument for a model by which no ray can be cast.
template <camera_model M>
void require_camera(M const& model) {
  refuse_camera(model.fault());
}

/// Faults that every model may have.
inline camera_fault size_fault(camera_base const& c) {
  if (c.width < 1 || c.height < 1) return {"the image size is not positive", "correct the width and height"};
  // Boxes count pixels in 16 bits, launches in 32, padded to blocks of 8 x 4.
  if (c.width > 65535 || c.height > 65535 || (u64(c.width) + 7) / 8 * 8 * ((u64(c.height) + 3) / 4 * 4) > 0xffffffffu)
    return {"the image is larger than 65535 pixels a side or 2^32 in all",
            "render it in parts, or raise dataset_options.downscale"};
  return {};
}

/// A position or rotation that is not finite.
inline camera_fault pose_fault(vec3d const& position, mat3 const& rotation) {
  for (int k = 0; k < 3; ++k) {
    bool finite = is_finite(static_cast<float>(position[k]));
    for (int j = 0; j < 3; ++j) finite = finite && is_finite(rotation[k][j]);
    if (!finite) return {"the pose is not finite", "correct the position and the rotation"};
  }
  return {};
}

/// Throws invalid_argument for a near distance that is not positive and finite.
inline void require_near(float near) {
  if (!(near > 0 && is_finite(near))) throw invalid_argument("footprints: near must be positive and finite");
}

/// A direction of any length, made a unit. It decides hits, so its arithmetic is fixed.
template <class F>
GART_HD GART_INLINE primary_ray_of<F> unit_ray(vec3_of<F> const& d) {
  F const inverse = divide(F(1.0f), square_root(fma(d.x, d.x, fma(d.y, d.y, mul(d.z, d.z)))));
  return {{mul(d.x, inverse), mul(d.y, inverse), mul(d.z, inverse)}};
}

/// The ray of each lane, by a function of one image point to a direction.
template <class F, class One>
GART_HD GART_INLINE primary_ray_of<F> each_lane(F u, F v, One const& one) {
#if !defined(__CUDACC__)
  if constexpr (std::is_same_v<F, lanes>) {
    primary_ray_of<F> out;
    for (int l = 0; l < lane_count; ++l) {
      vec3 const d = one(u.v[l], v.v[l]);
      for (int k = 0; k < 3; ++k) out.direction[k].v[l] = d[k];
    }
    return out;
  } else
#endif
    return {one(u, v)};
}

}}  // namespace gart::GART_ISA
