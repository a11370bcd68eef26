#pragma once
/// \file
/// The needs of the gradient of an image's depth, besides those of its colour (backward/terms.hpp). Depth is composited
/// as a fourth channel whose colour is a hit's t. So the gradient of alpha needs the depth that the pixel would have if
/// the hit were opaque. That is one float a slot, in an array beside the hit buffer, at the slot's number. The gradient
/// by the transmittance costs a hit nothing more. It is that of a channel which only the background has.

#include <gart/backward/hit_layout.hpp>
#include <gart/render/record.hpp>

#include <cstddef>

namespace gart { inline namespace GART_ISA {

/// Depth and transmittance of an image and the gradients by them, for kernels. Each is [H][W]; null where there is no
/// such gradient.
struct depth_image {
  float const* depth = nullptr;                   ///< sum of weight * t
  float const* transmittance = nullptr;           ///< after the last hit
  float const* depth_gradient = nullptr;          ///< dL/d depth
  float const* transmittance_gradient = nullptr;  ///< dL/d transmittance
  float const* slots = nullptr;                   ///< beside the hit buffer, a float a slot, where geometry is gathered

  /// dL/d depth of a pixel.
  GART_HD GART_INLINE float gradient(std::size_t pixel) const { return depth_gradient ? depth_gradient[pixel] : 0.0f; }
  /// The share of a pixel's depth and transmittance in C.g (math/hit_gradient.hpp).
  GART_HD GART_INLINE float total(std::size_t pixel) const {
    float sum = 0;
    if (depth_gradient) sum += depth[pixel] * depth_gradient[pixel];
    if (transmittance_gradient) sum += transmittance[pixel] * transmittance_gradient[pixel];
    return sum;
  }
};

/// A slot of the hit buffer with the depth beside it.
template <class Entry>
struct entry_with_depth : Entry {
  float depth;  ///< that the pixel would have if the hit were opaque
};

/// A record of the hit buffer (backward/record_slots.hpp) that also keeps depths.
template <class Record>
struct record_with_depth : Record {
  float* depths = nullptr;             ///< a float a slot
  static constexpr bool depth = true;  ///< it takes them
  using Record::operator();
  /// Writes a slot and its depth.
  GART_HD GART_INLINE void operator()(u32 place, vec3 const& opaque, float weight, vec3 const& unclamped,
                                      float opaque_depth) const {
    Record::operator()(place, opaque, weight, unclamped);
    if (place != tile_slots::none) depths[place] = opaque_depth;
  }

#if !defined(__CUDACC__)
  /// The same for the hits of a packet.
  GART_INLINE void operator()(lane_words places, lane_mask hits, vec3_of<lanes> const& opaque, lanes weight,
                              vec3_of<lanes> const& unclamped, lanes opaque_depth) const {
    Record::operator()(places, hits, opaque, weight, unclamped);
    for (u32 left = bits_of(hits); left; left &= left - 1)
      if (int const l = __builtin_ctz(left); places[l] != tile_slots::none) depths[places[l]] = opaque_depth.v[l];
  }
#endif
};

}}  // namespace gart::GART_ISA
