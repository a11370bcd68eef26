#pragma once
// The rays of pixels: through their middles, one at a time or a lane each.

#include <gart/math/ray_gaussian.hpp>
#include <gart/scene/camera.hpp>
#include <gart/trace/packet_block.hpp>
#include <gart/trace/pixel_order.hpp>

namespace gart::inline GART_ISA {

GART_HD inline primary_ray pixel_ray(camera const& c, pixel p) {
  return {ray_direction(c, static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f)};
}

#if !defined(__CUDACC__)
// The directions of a packet's rays, the same bits.
inline vec3_of<lanes> pixel_directions(camera const& c, packet_block const& block) {
  return ray_directions(c, block.centres_x(), block.centres_y());
}
#endif

}  // namespace gart::inline GART_ISA
