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
#include <gart/tiles/tile_planes.hpp>

#include <concepts>
#include <type_traits>

namespace gart::inline GART_ISA {

/// An order: it has the members that are listed above.
template <class O>
concept tile_order = std::is_trivially_copyable_v<O> &&
    requires(O order, O const& k, typename O::primitive const& p, index_t i, pixel_box const& cell, u32 tile) {
  { order.take(32) } -> std::same_as<int>;
  { k.shift() } -> std::same_as<int>;  // of a depth: the bits that keys leave out
  { k.of(i) } -> std::same_as<typename O::primitive>;
  { k.key(p, cell, tile) } -> std::same_as<u32>;
};

/// A depth (not negative) as an integer of the same order, `shift` low bits dropped; and the depth it stands for, which
/// is not larger.
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
  // The larger of two bounds, the first of which may say nothing.
  GART_HD GART_INLINE u32 key_of(float bound, float anywhere) const {
    return depth_key(bound > anywhere && bound <= 3.402823466e38f ? bound : anywhere, shift_);
  }
  int shift_ = 0;
};

}  // namespace detail

/// By how near the pair's pixels can hit the primitive: what the tile-list tracer reads. No hit of the pair has a
/// smaller depth, as the camera measures it, than its key stands for. This one is a pinhole's, whose rays all lie on
/// one plane's grid; others are of any_depth_order.
class depth_order : public detail::depth_bits {
 public:
  /// depths: of each primitive, anywhere. gaussians: null where that is all there is to go by; else the depth is
  /// bounded in each tile (math/rectangle_depth.hpp).
  depth_order(float const* depths, ray_gaussian const* gaussians, pinhole const& view)
      : depths_(depths), gaussians_(gaussians), rotation_(view.rotation) {
    to_u_ = 1 / view.fx, to_v_ = 1 / view.fy, cx_ = view.cx, cy_ = view.cy;
    float const u = std::fmax(std::fabs(view.cx), std::fabs(static_cast<float>(view.width) - view.cx)) * to_u_;
    float const v = std::fmax(std::fabs(view.cy), std::fabs(static_cast<float>(view.height) - view.cy)) * to_v_;
    reach_ = 1.01f + u + v;
  }

  /// What it needs of a primitive.
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
  /// As depth_order's; planes: a tile each, null where there are none.
  any_depth_order(float const* depths, ray_gaussian const* gaussians, tile_plane const* planes)
      : depths_(depths), gaussians_(gaussians), planes_(planes) {}

  /// What it needs of a primitive.
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
    constexpr float inset = tile_plane::inset;
    float const x0 = static_cast<float>(cell.x0 % Size) + inset - plane.widen_x;
    float const x1 = static_cast<float>((cell.x1 - 1) % Size + 1) - inset + plane.widen_x;
    float const y0 = static_cast<float>(cell.y0 % Size) + inset - plane.widen_y;
    float const y1 = static_cast<float>((cell.y1 - 1) % Size + 1) - inset + plane.widen_y;
    rectangle_depth const in(p.gaussian, mat3(plane.dx, plane.dy, plane.origin), plane.reach);
    return key_of(in(x0, x1, y0, y1), p.depth);
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  tile_plane const* planes_;
};

/// The order that a camera's tile lists are sorted by.
template <execution E, int Size>
class depth_orders {
 public:
  /// No planes yet.
  explicit depth_orders(E& exec) : planes_(exec) {}

  /// rays: of the model, where they have one centre. The order is valid until the next call.
  ///@{
  /// The order of a view; rays: of the model, where they have one centre. It is valid until the next call.
  depth_order of(E&, pinhole const& model, pixel_rays const&, float const* depths, ray_gaussian const* gaussians) {
    return {depths, gaussians, model};
  }
  template <camera_model M>
  any_depth_order<Size> of(E& exec, M const& model, [[maybe_unused]] pixel_rays const& rays, float const* depths,
                           ray_gaussian const* gaussians) {
    if constexpr (central_camera<M>) {
      tile_grid<Size> const grid{model.width, model.height};
      planes_.resize(grid.count());
      parallel_for(exec, "map/planes", grid.count(), tile_planes<Size>{rays, grid, planes_});
      return {depths, gaussians, planes_.data()};
    } else {
      return {depths, gaussians, nullptr};
    }
  }
  ///@}

 private:
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

}  // namespace gart::inline GART_ISA
