#pragma once
/// \file
/// The rays of pixels: through their middles, one at a time or a lane each.

#include <gart/camera/pixel_rays.hpp>
#include <gart/trace/packet_block.hpp>
#include <gart/trace/pixel_order.hpp>

namespace gart { inline namespace GART_ISA {

/// The ray of a pixel of the view that `rays` was made for, in its frame.
template <rays_of_pixels Rays>
GART_HD GART_INLINE typename Rays::ray_type pixel_ray(Rays const& rays, pixel p) {
  return rays.of(p.x, p.y);
}

/// Host side, of any camera with one centre.
inline primary_ray pixel_ray(camera const& c, pixel p) {
  return {ray_direction(c, static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f)};
}

#if !defined(__CUDACC__)
/// The directions of a packet's rays, the same bits. Beyond the image they are some pixel's.
inline vec3_of<lanes> pixel_directions(pixel_rays const& rays, packet_block const& block) {
  if (!rays.directions) return rays.view.ray(block.centres_x(), block.centres_y()).direction;
  vec3_of<lanes> out;
  for (int l = 0; l < lane_count; ++l) {
    int const x = block.x + packet_block::column(l), y = block.y + packet_block::row(l);
    vec3 const d = rays.of(x < rays.view.width ? x : block.x, y < rays.view.height ? y : block.y).direction;
    out.x.v[l] = d.x, out.y.v[l] = d.y, out.z.v[l] = d.z;
  }
  return out;
}
#endif

}}  // namespace gart::GART_ISA
