#pragma once
// How far a lens moves the rays of a tile: what bounds of slopes over a tile's pixels (tiles/tile_order.hpp) need of a
// distorted camera. One undistorted point a tile; from it, for every ray of the tile through the image point
// (a, b) in units of the focal length,
//   u in a + shift.u +- widening,  v in b + shift.v +- widening.
//
// distort() is p + e(p) with |e'(p)| at most d(r) at the distance r, increasing. Where d < 1 over a disc it has an
// inverse there whose shift changes by at most d / (1 - d) times the distance. Where d reaches a half the widening is
// infinite: nothing is said of such tiles.

#include <gart/core/span.hpp>
#include <gart/scene/camera.hpp>
#include <gart/tiles/grid.hpp>

namespace gart::inline GART_ISA {

struct lens_shift {
  float u = 0, v = 0;
  float widening = 0;
};

template <int Size>
struct lens_shifts {
  camera view;
  tile_grid<Size> grid;
  span<lens_shift> shifts;

  GART_KERNEL void operator()(index_t tile) const {
    float const a = ((static_cast<float>(tile % grid.columns()) + 0.5f) * Size - view.cx) / view.fx;
    float const b = ((static_cast<float>(tile / grid.columns()) + 0.5f) * Size - view.cy) / view.fy;
    vec2 const p = undistort(view.lens, {a, b});
    // What p is the exact answer for; the tile's corners are so far from there.
    double u, v;
    distort(view.lens, p.x, p.y, u, v);
    float const off_u = static_cast<float>(u) - a, off_v = static_cast<float>(v) - b;
    float const far =
        0.5f * Size * sqrtf(1 / (view.fx * view.fx) + 1 / (view.fy * view.fy)) + sqrtf(off_u * off_u + off_v * off_v);
    float const r = sqrtf(p.x * p.x + p.y * p.y) + 2 * far;
    float const r2 = r * r;
    float const d = 3 * fabsf(view.lens.k1) * r2 + 5 * fabsf(view.lens.k2) * r2 * r2 +
                    9 * (fabsf(view.lens.p1) + fabsf(view.lens.p2)) * r;
    // A little more for the rounding of all this.
    shifts[tile] = {p.x - static_cast<float>(u), p.y - static_cast<float>(v),
                    d < 0.5f ? d / (1 - d) * far * 1.001f + 1e-6f : 3.402823466e38f};
  }
};

}  // namespace gart::inline GART_ISA
