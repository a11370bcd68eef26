#pragma once
// The orders of a tile's list. An order turns a (primitive, tile) pair into the low bits of its key:
//   take(free_bits)   how many of the key's free bits it uses, asked once, before anything else
//   of(i)             what it needs of primitive i, for all its tiles
//   shift()           of a depth, how many low bits keys leave out; 0 where they hold none
//   key(p, cell, tile)  of the pair whose pixels are `cell`, the primitive's box cut by the tile of this number

#include <gart/math/rectangle_depth.hpp>
#include <gart/scene/camera.hpp>
#include <gart/tiles/grid.hpp>
#include <gart/tiles/lens_shifts.hpp>

#include <concepts>
#include <type_traits>

namespace gart::inline GART_ISA {

template <class O>
concept tile_order = std::is_trivially_copyable_v<O> &&
    requires(O order, O const& k, typename O::primitive const& p, index_t i, pixel_box const& cell, u32 tile) {
  { order.take(32) } -> std::same_as<int>;
  { k.shift() } -> std::same_as<int>;  // of a depth: the bits that keys leave out
  { k.of(i) } -> std::same_as<typename O::primitive>;
  { k.key(p, cell, tile) } -> std::same_as<u32>;
};

// A depth (not negative) as an integer of the same order, `shift` low bits dropped; and the depth it stands for, which
// is not larger.
GART_HD GART_INLINE u32 depth_key(float depth, int shift) { return float_to_bits(depth) >> shift; }
GART_HD GART_INLINE float near_depth(u32 key, int shift) { return bits_to_float(key << shift); }

// By how near the pair's pixels can hit the primitive: what the tile-list tracer reads. No hit of the pair has a
// smaller z than its key stands for.
class depth_order {
 public:
  // depths: near depth of each primitive, anywhere. gaussians: null where that is all there is to go by; else the depth
  // is bounded in each tile (math/rectangle_depth.hpp), for a camera with a lens if its tiles' shifts are given.
  depth_order(float const* depths, ray_gaussian const* gaussians, camera const& view,
              lens_shift const* shifts = nullptr)
      : depths_(depths),
        gaussians_(view.lens.any() && !shifts ? nullptr : gaussians),
        shifts_(view.lens.any() ? shifts : nullptr),
        rotation_(view.rotation) {
    to_u_ = 1 / view.fx, to_v_ = 1 / view.fy, cx_ = view.cx, cy_ = view.cy;
    float const u = std::fmax(std::fabs(view.cx), std::fabs(static_cast<float>(view.width) - view.cx)) * to_u_;
    float const v = std::fmax(std::fabs(view.cy), std::fabs(static_cast<float>(view.height) - view.cy)) * to_v_;
    reach_ = 1.01f + (shifts_ ? 2 : 1) * (u + v);
  }

  int take(int free_bits) {
    shift_ = 31 - free_bits > 0 ? 31 - free_bits : 0;  // 31: a depth's sign bit is never set
    return free_bits;
  }
  int shift() const { return shift_; }

  struct primitive {
    rectangle_depth in;
    float depth;
  };
  GART_HD primitive of(index_t i) const {
    return {rectangle_depth(gaussians_ ? gaussians_[i] : ray_gaussian{}, rotation_, reach_), depths_[i]};
  }
  GART_HD u32 key(primitive const& p, pixel_box const& cell, u32 tile) const {
    u32 const anywhere = depth_key(p.depth, shift_);
    if (!gaussians_) return anywhere;
    // Rays go through the middle of pixels; a little more, for the rounding of directions.
    constexpr float inset = 0.45f;
    float u0 = (cell.x0 + inset - cx_) * to_u_, u1 = (cell.x1 - inset - cx_) * to_u_;
    float v0 = (cell.y0 + inset - cy_) * to_v_, v1 = (cell.y1 - inset - cy_) * to_v_;
    if (shifts_) {
      lens_shift const s = shifts_[tile];
      u0 += s.u - s.widening, u1 += s.u + s.widening, v0 += s.v - s.widening, v1 += s.v + s.widening;
      float const u = fabsf(u0) > fabsf(u1) ? fabsf(u0) : fabsf(u1), v = fabsf(v0) > fabsf(v1) ? fabsf(v0) : fabsf(v1);
      if (!(1 + u + v < reach_)) return anywhere;
    }
    float const z = p.in(u0, u1, v0, v1);
    return z > p.depth && z <= 3.402823466e38f ? depth_key(z, shift_) : anywhere;
  }

 private:
  float const* depths_;
  ray_gaussian const* gaussians_;
  lens_shift const* shifts_;
  mat3 rotation_;
  float to_u_, to_v_, cx_, cy_, reach_;
  int shift_ = 0;
};

// By the primitives' numbers, in which the pairs come.
struct number_order {
  int take(int) const { return 0; }
  int shift() const { return 0; }

  struct primitive {};
  GART_HD primitive of(index_t) const { return {}; }
  GART_HD u32 key(primitive, pixel_box const& /*cell*/, u32 /*tile*/) const { return 0; }
};
static_assert(tile_order<depth_order> && tile_order<number_order>);

}  // namespace gart::inline GART_ISA
