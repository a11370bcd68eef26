#pragma once
/// \file
/// Where the rays of a tile pass, for cameras whose rays are no plane's grid. A plane lies across the tile's middle ray
/// with a grid of pixels on it. A bound says how far any ray of the tile lies from its place there. It is found from
/// each of the rays. Whatever the lens, every ray through pixels [x0, x1) x [y0, y1) of the tile passes through a point
/// P:
///   P = origin + x dx + y dy,   x0 + inset - widen_x <= x <= x1 - inset + widen_x, y likewise.
/// Both count pixels from the tile's corner. The part of P along the middle ray is 1. So math/rectangle_depth.hpp
/// bounds what a hit's distance is at least. Tiles that see more than some 100 degrees, or a line, have no plane. Cost:
/// one launch, two readings of every ray.

#include <gart/camera/pixel_rays.hpp>
#include <gart/tiles/grid.hpp>

namespace gart { inline namespace GART_ISA {

/// A part of a tile's grid, in pixels counted from the tile's.
struct tile_rectangle {
  float x0, x1, y0, y1;  ///< borders
};

/// The grid of a tile's rays.
struct alignas(16) tile_plane {
  vec3 origin;    ///< of the grid, at the tile's corner
  float widen_x;  ///< pixels by which rays lie beside the grid
  vec3 dx;        ///< from pixel to pixel
  float widen_y;  ///< the same, down
  vec3 dy;        ///< from pixel to pixel, down
  float reach;    ///< of math/rectangle_depth.hpp; 0 where there is no plane

  /// Rays go through the middle of pixels, 0.5; the rest is for the rounding of their directions.
  static constexpr float inset = 0.45f;

  /// Where the rays of a part of a tile of Size pixels a side pass.
  template <int Size>
  GART_HD GART_INLINE tile_rectangle rectangle(pixel_box const& cell) const {
    return {static_cast<float>(cell.x0 % Size) + inset - widen_x,
            static_cast<float>((cell.x1 - 1) % Size + 1) - inset + widen_x,
            static_cast<float>(cell.y0 % Size) + inset - widen_y,
            static_cast<float>((cell.y1 - 1) % Size + 1) - inset + widen_y};
  }
};

/// Kernel over tiles: finds the plane of each.
template <int Size>
struct tile_planes {
  pixel_rays rays;          ///< of the view
  tile_grid<Size> grid;     ///< of the view
  span<tile_plane> planes;  ///< [tiles]

  /// Of one tile.
  GART_KERNEL void operator()(index_t tile) const { planes[tile] = plane_of(grid.tile(tile)); }

 private:
  static constexpr double least_cosine = 0.6, most_reach = 4;

  GART_HD vec3d direction(int x, int y) const { return vec3d(rays.of(x, y).direction); }

  GART_HD tile_plane plane_of(pixel_box const& area) const {
    int const w = static_cast<int>(area.width()), h = static_cast<int>(area.height());
    vec3d middle(0.0);
    GART_NO_UNROLL
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) middle += direction(area.x0 + x, area.y0 + y);
    double const length = glm::length(middle);
    tile_plane none{};
    if (!(length > 0.5)) return none;
    middle = middle / length;
    bool wide = false;
    auto const on_plane = [&](int x, int y) {
      vec3d const d = direction(area.x0 + x, area.y0 + y);
      double const along = glm::dot(d, middle);
      wide = wide || !(along > least_cosine);
      return d / along;
    };
    vec3d const a = on_plane(0, 0), b = on_plane(w - 1, 0), c = on_plane(0, h - 1), d = on_plane(w - 1, h - 1);
    vec3d dx = w > 1 ? ((b - a) + (d - c)) / (2.0 * (w - 1)) : vec3d(0.0);
    vec3d dy = h > 1 ? ((c - a) + (d - b)) / (2.0 * (h - 1)) : vec3d(0.0);
    // One row or column of pixels: the grid is square.
    if (w == 1 && h == 1) dx = glm::cross(middle, fabs(middle.x) < 0.6 ? vec3d(1, 0, 0) : vec3d(0, 1, 0)) * 1e-4;
    if (h == 1)
      dy = glm::cross(middle, dx);
    else if (w == 1)
      dx = glm::cross(dy, middle);
    vec3d const normal = glm::cross(dx, dy);
    double const area2 = glm::dot(normal, normal);
    if (!(area2 > 1e-6 * glm::dot(dx, dx) * glm::dot(dy, dy)) || !(glm::dot(dx, dx) > 1e-24)) return none;
    vec3d const corner = (a + b + c + d) / 4.0 - dx * (0.5 * w) - dy * (0.5 * h);
    double off_x = 0, off_y = 0;
    GART_NO_UNROLL
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        vec3d const off = on_plane(x, y) - corner - dx * (x + 0.5) - dy * (y + 0.5);
        double const ox = fabs(glm::dot(glm::cross(off, dy), normal)) / area2,
                     oy = fabs(glm::dot(glm::cross(dx, off), normal)) / area2;
        off_x = ox > off_x ? ox : off_x, off_y = oy > off_y ? oy : off_y;
      }
    double const reach =
        glm::length(corner) + glm::length(dx) * (Size + off_x + 1) + glm::length(dy) * (Size + off_y + 1);
    if (wide || !(reach < most_reach)) return none;
    return {vec3(corner), static_cast<float>(off_x * 1.000001), vec3(dx), static_cast<float>(off_y * 1.000001),
            vec3(dy),     static_cast<float>(reach * 1.01)};
  }
};

}}  // namespace gart::GART_ISA
