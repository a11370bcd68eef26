#pragma once
/// \file
/// Which tiles of a Gaussian's box can hit it. Each (primitive, tile) pair is tested before it enters a list. A pair
/// that fails is in no list. A test has:
///   of(i)                 what it needs of primitive i, for all its tiles
///   meets(p, cell, tile)  false only where no ray of the pair hits: `cell`, the box cut by the tile of this number
///
/// A box of one row or one column of tiles has all of them. For the silhouette is connected and touches the box's ends.

#include <gart/camera/models.hpp>
#include <gart/math/silhouette.hpp>
#include <gart/tiles/tile_planes.hpp>

#include <concepts>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// A test: it has the members that are listed above.
template <class T>
concept pair_test = std::is_trivially_copyable_v<T> &&
    requires(T const& t, typename T::primitive const& p, index_t i, pixel_box const& cell, u32 tile) {
  { t.of(i) } -> std::same_as<typename T::primitive>;
  { t.meets(p, cell, tile) } -> std::same_as<bool>;
};

/// All tiles of a box.
struct every_pair {
  struct primitive {};
  /// Of any primitive.
  GART_HD primitive of(index_t) const { return {}; }
  /// Of any pair.
  GART_HD bool meets(primitive const&, pixel_box const&, u32) const { return true; }
};

/// Those that a silhouette meets, in a pinhole's view.
class silhouette_pairs {
 public:
  using primitive = silhouette;  ///< in pixels

  /// gaussians: in the view's frame.
  silhouette_pairs(ray_gaussian const* gaussians, pinhole const& view) : gaussians_(gaussians) {
    mat3 const& r = view.rotation;
    for (int k = 0; k < 3; ++k)
      to_image_[k] = {double{view.fx} * r[0][k] + double{view.cx} * r[2][k],
                      double{view.fy} * r[1][k] + double{view.cy} * r[2][k], r[2][k]};
  }
  /// Of primitive i.
  GART_HD primitive of(index_t i) const { return {gaussians_[i], to_image_}; }
  /// Of a pair.
  GART_HD GART_INLINE bool meets(primitive const& p, pixel_box const& cell, u32 /*tile*/) const {
    return p.meets(cell.x0 + 0.5f, cell.x1 - 0.5f, cell.y0 + 0.5f, cell.y1 - 0.5f);
  }

 private:
  ray_gaussian const* gaussians_;
  mat3d to_image_;
};

/// The same for any camera with one centre, on the plane of each tile where it has one.
template <int Size>
class plane_silhouette_pairs {
 public:
  using primitive = ray_gaussian;  ///< in the view's frame

  /// As silhouette_pairs'; planes: a tile each.
  plane_silhouette_pairs(ray_gaussian const* gaussians, tile_plane const* planes)
      : gaussians_(gaussians), planes_(planes) {}
  /// Of primitive i.
  GART_HD primitive of(index_t i) const { return gaussians_[i]; }
  /// Of a pair.
  GART_HD bool meets(primitive const& p, pixel_box const& cell, u32 tile) const {
    tile_plane const plane = planes_[tile];
    if (!(plane.reach > 0)) return true;
    tile_rectangle const r = plane.rectangle<Size>(cell);
    return silhouette(p, inverse(vec3d(plane.dx), vec3d(plane.dy), vec3d(plane.origin))).meets(r.x0, r.x1, r.y0, r.y1);
  }

 private:
  // Of the matrix with these columns.
  GART_HD static mat3d inverse(vec3d const& x, vec3d const& y, vec3d const& z) {
    vec3d const yz = glm::cross(y, z), zx = glm::cross(z, x), xy = glm::cross(x, y);
    double const by = 1 / glm::dot(x, yz);
    return {yz.x * by, zx.x * by, xy.x * by, yz.y * by, zx.y * by, xy.y * by, yz.z * by, zx.z * by, xy.z * by};
  }

  ray_gaussian const* gaussians_;
  tile_plane const* planes_;
};

///@{
/// The test of a view for which tiles have no planes.
inline silhouette_pairs pair_test_of(pinhole const& view, ray_gaussian const* gaussians) { return {gaussians, view}; }
inline every_pair pair_test_of(camera_base const&, ray_gaussian const*) { return {}; }
///@}

static_assert(pair_test<every_pair> && pair_test<silhouette_pairs>);

}}  // namespace gart::GART_ISA
