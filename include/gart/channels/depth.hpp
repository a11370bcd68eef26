#pragma once
/// \file
/// Two channels of a ray: its depth, the sum of w t, and its transmittance. The latter is a channel of the background
/// alone.

#include <gart/channels/channel.hpp>

namespace gart { inline namespace GART_ISA {

/// The value of a hit is its distance, which moves with the Gaussian.
struct depth_channel : channel_base {
  static constexpr bool moves = true;  ///< t is a function of the Gaussian
  float const* gradient = nullptr;     ///< dL/d depth, [R]; null: there is none
  /// Adds w t.
  GART_HD GART_INLINE void add(listed_hit const& h, int, int, float (&sums)[1]) const { sums[0] += h.weight * h.t; }
  /// t dL/d depth.
  GART_HD GART_INLINE float worth(listed_hit const& h) const { return gradient ? h.t * gradient[h.ray] : 0.0f; }
  /// w dL/d depth.
  GART_HD GART_INLINE float along(listed_hit const& h) const { return gradient ? h.weight * gradient[h.ray] : 0.0f; }
};
static_assert(channel<depth_channel>);

/// Hits add nothing; what they let through is 1.
struct transmittance_channel : channel_base {
  float const* gradient = nullptr;  ///< dL/d transmittance, [R]; null: there is none
  /// Nothing.
  GART_HD GART_INLINE void add(listed_hit const&, int, int, float (&)[1]) const {}
  /// Nothing.
  GART_HD GART_INLINE float worth(listed_hit const&) const { return 0; }
  /// dL/d transmittance.
  GART_HD GART_INLINE float beyond(u32 ray_number) const { return gradient ? gradient[ray_number] : 0.0f; }
};
static_assert(channel<transmittance_channel>);

}}  // namespace gart::GART_ISA
