#pragma once
/// \file
/// The orders of a tile's list. An order turns a (primitive, tile) pair into the low bits of its key:
///   take(free_bits)   how many of the key's free bits it uses, asked once, before anything else
///   of(i)             what it needs of primitive i, for all its tiles
///   shift()           of a depth, how many low bits keys leave out; 0 where they hold none
///   key(p, cell, tile)  of the pair whose pixels are `cell`, the primitive's box cut by the tile of this number

#include <gart/camera/models.hpp>
#include <gart/math/rectangle_depth.hpp>
#include <gart/tiles/grid.hpp>
#include <gart/tiles/pair_test.hpp>
#include <gart/tiles/tile_planes.hpp>

#include <concepts>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// An order: it has the members that are listed above.
template <class O>
concept tile_order = std::is_trivially_copyable_v<O> &&
    requires(O order, O const& k, typename O::primitive const& p, index_t i, pixel_box const& cell, u32 tile) {
  { order.take(32) } -> std::same_as<int>;
  { k.shift() } -> std::same_as<int>;  // of a depth: the bits that keys leave out
  { k.of(i) } -> std::same_as<typename O::primitive>;
  { k.key(p, cell, tile) } -> std::same_as<u32>;
};

/// A depth (not negative) as an integer of the same order, `shift` low bits dropped. And back: the depth it stands for,
/// which is not larger.
GART_HD GART_INLINE u32 depth_key(float depth, int shift) { return float_to_bits(depth) >> shift; }
/// The depth that a key stands for.
GART_HD GART_INLINE float near_depth(u32 key, int shift) { return bits_to_float(key << shift); }

namespace detail {

// A key in as many bits as are free.
class depth_bits {
 public:
  int take(int free_bits) {
    shift_ = 31 - free_bits > 0 ? 31 - free_bits : 0;  // 31: a depth's sign bit is never set
    return free_bits;
  }
  int shift() const { return shift_; }

 protected:
  // The larger of two bounds; the first may be missing.
  GART_HD GART_INLINE u32 key_of(float bound, float anywhere) const {
    return depth_key(bound > anywhere && bound <= 3.402823466e38f ? bound : anywhere, shift_);
  }
  int shift_ = 0;
};

}  // namespace detail

/// By how near the pair's pixels can hit the primitive; the tile-list tracer reads these lists. No hit of the pair has
/// a smaller depth, as the camera measures it, than its key stands for. This one is a pinhole's, whose rays all lie on
/// one plane's grid; others are of any_depth_order.
class depth_order : public detail::depth_bits {
 public:
  /// `depths`: of each primitive, anywhere. `gaussians`: null where that is all there is to go by. Else the depth is
  /// bounded in each tile (math/rectangle_depth.hpp).
  depth_order(float const* depths, ray_gaussian const* gaussians, pinhole const& view)
      : depths_(depths), gaussians_(gaussians), rotation_(view.rotation) {
    to_u_ = 1 / view.fx, to_v_ = 1 / view.fy, cx_ = view.cx, cy_ = view.cy;
    float const u = std::fmax(std::fabs(view.cx), std::fabs(static_cast<float>(view.width) - view.cx)) * to_u_;
    float const v = std::fmax(std::fabs(view.cy), std::fabs(static_cast<float>(view.height) - view.cy)) * to_v_;
    reach_ = 1.01f + u + v;
  }

  /// Its data of a primitive.
  struct primitive {
    rectangle_depth in;  ///< its bound; unused without Gaussians
    float depth;         ///< anywhere
  };
  /// Of primitive i.
  GART_HD primitive of(index_t i) const {
    return {rectangle_depth(gaussians_ ? gaussians_[i] : ray_gaussian{}, rotation_, reach_), depths_[i]};
  }
  /// Of a pair.
  GART_HD u32 key(primitive const& p, pixel_box const& cell, u32 /*tile*/) const {
    if (!gaussians_) return depth_key(p.depth, shift_);
    constexpr float inset = tile_plane::inset;
    float const u0 = (cell.x0 + inset - cx_) * to_u_, u1 = (cell.x1 - inset - cx_) * to_u_;
    float const v0 = (cell.y0 + inset - cy_) * to_v_, v1 = (cell.y1 - inset - cy_) * to_v_;
    return key_of(p.in(u0, u1, v0, v1), p.depth);
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  mat3 rotation_;
  float to_u_, to_v_, cx_, cy_, reach_;
};

/// The same for any camera, by distance along the ray: bounded by the tile's plane where there are planes.
template <int Size>
class any_depth_order : public detail::depth_bits {
 public:
  /// As depth_order's; planes: a tile each, or null.
  any_depth_order(float const* depths, ray_gaussian const* gaussians, tile_plane const* planes)
      : depths_(depths), gaussians_(gaussians), planes_(planes) {}

  /// Its data of a primitive.
  struct primitive {
    ray_gaussian gaussian;  ///< unused without planes
    float depth;            ///< anywhere
  };
  /// Of primitive i.
  GART_HD primitive of(index_t i) const { return {planes_ ? gaussians_[i] : ray_gaussian{}, depths_[i]}; }
  /// Of a pair.
  GART_HD u32 key(primitive const& p, pixel_box const& cell, u32 tile) const {
    if (!planes_) return depth_key(p.depth, shift_);
    tile_plane const plane = planes_[tile];
    if (!(plane.reach > 0)) return depth_key(p.depth, shift_);
    tile_rectangle const r = plane.rectangle<Size>(cell);
    rectangle_depth const in(p.gaussian, mat3(plane.dx, plane.dy, plane.origin), plane.reach);
    return key_of(in(r.x0, r.x1, r.y0, r.y1), p.depth);
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  tile_plane const* planes_;
};

/// The same for rays that begin at a moving camera: those of a tile on a part of its way.
template <int Size>
class moving_depth_order : public detail::depth_bits {
 public:
  /// As any_depth_order's; rays: of the view, whose origins within a tile lie between those of its corners.
  moving_depth_order(float const* depths, ray_gaussian const* gaussians, tile_plane const* planes,
                     origin_rays const& rays)
      : depths_(depths), gaussians_(gaussians), planes_(planes), rays_(rays) {}

  /// Its data of a primitive.
  struct primitive {
    ray_gaussian gaussian;  ///< in the view's frame
    float depth;            ///< anywhere
  };
  /// Of primitive i.
  GART_HD primitive of(index_t i) const { return {gaussians_[i], depths_[i]}; }
  /// Of a pair.
  GART_HD u32 key(primitive const& p, pixel_box const& cell, u32 tile) const {
    tile_plane const plane = planes_[tile];
    if (!(plane.reach > 0)) return depth_key(p.depth, shift_);
    tile_rectangle const r = plane.rectangle<Size>(cell);
    vec3 const first = rays_.of(cell.x0, cell.y0).origin, last = rays_.of(cell.x1 - 1, cell.y1 - 1).origin;
    moving_rectangle_depth const in(p.gaussian, mat3(plane.dx, plane.dy, plane.origin), plane.reach,
                                    0.5f * (first + last), 0.5f * (last - first));
    return key_of(in(r.x0, r.x1, r.y0, r.y1), p.depth);
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  tile_plane const* planes_;
  origin_rays rays_;
};

/// The same for parallel rays. Where the response is largest on a ray is linear in the pixel, so least at a corner.
class parallel_depth_order : public detail::depth_bits {
 public:
  /// As depth_order's.
  parallel_depth_order(float const* depths, ray_gaussian const* gaussians, orthographic const& view)
      : depths_(depths), gaussians_(gaussians), direction_(view.ray(0, 0).direction) {
    corner_ = vec3d(0.0);
    for (int k = 0; k < 3; ++k) {
      across_[k] = double{view.rotation[0][k]} / view.fx, down_[k] = double{view.rotation[1][k]} / view.fy;
      corner_[k] = -across_[k] * view.cx - down_[k] * view.cy;
    }
    auto const norm1 = [](vec3d const& a) { return std::fabs(a.x) + std::fabs(a.y) + std::fabs(a.z); };
    far_ = norm1(corner_) + norm1(across_) * view.width + norm1(down_) * view.height;
  }

  /// Its data of a primitive: t = base + u across + v down, off by `loss` and a part of itself.
  struct primitive {
    double base, across, down, loss, part;  ///< by pixels
    float depth;                            ///< anywhere
  };
  /// Of primitive i.
  GART_HD primitive of(index_t i) const {
    constexpr double rounding = 4e-6;  // 64 of them
    ray_gaussian const g = gaussians_[i];
    primitive p{0, 0, 0, 0, 0, depths_[i]};
    double dd = 0, width2 = 0;
    for (int k = 0; k < 3; ++k) {
      vec3d const m(g.m[k].x, g.m[k].y, g.m[k].z);
      auto const along = [&](vec3d const& a) { return m.x * a.x + m.y * a.y + m.z * a.z; };
      double const d = along(direction_), row = fabs(m.x) + fabs(m.y) + fabs(m.z), o = g.m[k].o;
      p.base -= d * (o + along(corner_)), p.across -= d * along(across_), p.down -= d * along(down_);
      p.loss += (fabs(o) + row * far_) * (fabs(d) + row), width2 += row * (2 * fabs(d) + rounding * row);
      dd += d * d;
    }
    p.base /= dd, p.across /= dd, p.down /= dd;
    p.loss *= rounding / dd, p.part = rounding * width2 / dd;
    return p;
  }
  /// Of a pair.
  GART_HD u32 key(primitive const& p, pixel_box const& cell, u32 /*tile*/) const {
    constexpr double inset = tile_plane::inset;
    double const x = (p.across < 0 ? cell.x1 - inset : cell.x0 + inset) * p.across;
    double const y = (p.down < 0 ? cell.y1 - inset : cell.y0 + inset) * p.down;
    return key_of(static_cast<float>(((p.base + x + y) * (1 - p.part) - p.loss) * (1 - 1e-6)), p.depth);
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  vec3d direction_, corner_, across_, down_;
  double far_;
};

/// The order that a camera's tile lists are sorted by.
template <execution E, int Size>
class depth_orders {
 public:
  /// No planes yet.
  explicit depth_orders(E& exec) : planes_(exec) {}

  ///@{
  /// The order of a view, whose rays are cast. It is valid until the next call.
  depth_order of(E&, pinhole const& model, camera_rays<E> const&, float const* depths, ray_gaussian const* gaussians) {
    return {depths, gaussians, model};
  }
  parallel_depth_order of(E&, orthographic const& model, camera_rays<E> const&, float const* depths,
                          ray_gaussian const* gaussians) {
    return {depths, gaussians, model};
  }
  template <class Lens>
  moving_depth_order<Size> of(E& exec, rolling_shutter<Lens> const& model, camera_rays<E> const& rays,
                              float const* depths, ray_gaussian const* gaussians) {
    pixel_rays directions = rays.view();
    directions.directions = rays.with_origins().directions;
    find_planes(exec, model, directions);
    return {depths, gaussians, planes_.data(), rays.with_origins()};
  }
  template <camera_model M>
  any_depth_order<Size> of(E& exec, M const& model, [[maybe_unused]] camera_rays<E> const& rays, float const* depths,
                           ray_gaussian const* gaussians) {
    if constexpr (central_camera<M>) {
      find_planes(exec, model, rays.view());
      return {depths, gaussians, planes_.data()};
    } else {
      return {depths, gaussians, nullptr};
    }
  }
  ///@}

  /// The test of pairs of the same view, after its order, with whose planes it goes.
  template <camera_model M>
  auto test_of(M const& model, ray_gaussian const* gaussians) const {
    if constexpr (central_camera<M> && !std::is_same_v<M, pinhole>)
      return plane_silhouette_pairs<Size>(gaussians, planes_.data());
    else
      return pair_test_of(model, gaussians);
  }

 private:
  void find_planes(E& exec, camera_base const& model, pixel_rays const& directions) {
    tile_grid<Size> const grid{model.width, model.height};
    planes_.resize(grid.count());
    parallel_for(exec, "map/planes", grid.count(), tile_planes<Size>{directions, grid, planes_});
  }

  buffer<tile_plane, E> planes_;
};

/// By the primitives' numbers, in which the pairs come.
struct number_order {
  /// None of the bits.
  int take(int) const { return 0; }
  /// Keys hold no depth.
  int shift() const { return 0; }

  struct primitive {};
  /// Of any primitive.
  GART_HD primitive of(index_t) const { return {}; }
  /// Of any pair.
  GART_HD u32 key(primitive, pixel_box const& /*cell*/, u32 /*tile*/) const { return 0; }
};
static_assert(tile_order<depth_order> && tile_order<number_order>);

}}  // namespace gart::GART_ISA
