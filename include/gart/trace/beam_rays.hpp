#pragma once
/// \file
/// The beam that rays make, a ray a lane, and whether they stay close enough together for one.

#include <gart/bvh/beam.hpp>
#include <gart/bvh/bvh.hpp>
#include <gart/trace/lane_values.hpp>

namespace gart { inline namespace GART_ISA {

/// A beam, if they do.
struct made_beam {
  bool narrow;  ///< else there is none
  beam bounds;  ///< of its rays
};

/// Rays of a beam may differ by this much in slope. Wider beams meet so many boxes that miss all their rays that single
/// rays are faster. Their origins differ by a 128th of this, in sizes of the tree.
inline constexpr float widest_beam = 0.25f;

/// Of the rays of all lanes that have one; `placed` gives a lane's in the frame of the tree. One at least has.
template <class Has, class Placed>
GART_HD GART_INLINE made_beam beam_of(bvh_view const& tree, Has const& has, Placed const& placed,
                                      float widest = widest_beam) {
  per_lane<placed_ray> rays;
  each_lane([&](int l) {
    if (has(l)) rays[l] = placed(l);
  });
  auto const least = [&](auto const& f) {
    return least_of_lanes([&](int l) { return has(l) ? f(rays[l]) : infinity; });
  };
  auto const greatest = [&](auto const& f) { return -least([&](placed_ray const& r) { return -f(r); }); };
  auto const part = [](vec3 const& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
  made_beam out;
  out.narrow = false;
  beam& b = out.bounds;
  b.axis[0] = 0, b.forward = 1;
  float along = 0;  // the axis, of any ray at least
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    float const lo = least([&](placed_ray const& r) { return part(r.direction, k); });
    float const hi = greatest([&](placed_ray const& r) { return part(r.direction, k); });
    float const size = larger(lo, -hi);
    if (size > along) along = size, b.axis[0] = k, b.forward = lo > 0 ? 1.0f : -1.0f;
  }
  b.axis[1] = (b.axis[0] + 1) % 3, b.axis[2] = (b.axis[0] + 2) % 3;
  if (!(along > 0.25f)) return out;
  auto const stretch = [&](placed_ray const& r) { return 1.0f / fabsf(part(r.direction, b.axis[0])); };
  b.least_stretch = least(stretch), b.greatest_stretch = greatest(stretch);
  b.pad = greatest([](placed_ray const& r) { return r.pad; });
  float wide = 0, apart = 0, size = 0;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    int const axis = b.axis[k];
    b.least_origin[k] = least([&](placed_ray const& r) { return part(r.origin, axis); });
    b.greatest_origin[k] = greatest([&](placed_ray const& r) { return part(r.origin, axis); });
    apart = larger(b.greatest_origin[k] - b.least_origin[k], apart);
    size = larger(255.0f * tree.nodes[0].axis(axis).step(), size);
    if (k == 0) continue;
    auto const slope = [&](placed_ray const& r) { return part(r.direction, axis) * stretch(r); };
    float const lo = least(slope), hi = greatest(slope);
    wide += hi - lo;
    b.by_least_slope[k - 1] = slab_inverse(lo), b.by_greatest_slope[k - 1] = slab_inverse(hi);
  }
  out.narrow = wide <= widest && apart <= widest / 128 * size;
  return out;
}

}}  // namespace gart::GART_ISA
