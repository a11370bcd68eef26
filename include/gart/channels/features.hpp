#pragma once
/// \file
/// The channel of N features a Gaussian (scene/features.hpp): the value of a hit is its Gaussian's row. What no hit
/// covers has features of zero.

#include <gart/channels/channel.hpp>
#include <gart/scene/features.hpp>

namespace gart { inline namespace GART_ISA {

/// Chunk: numbers a lane. On a device neighbouring lanes take neighbouring chunks of one ray. So rows are read whole.
template <int Chunk>
struct feature_channel : channel_base {
  static constexpr int chunk = Chunk;  ///< numbers that one lane sums at a time
  feature_view<float const> features;  ///< [N Gaussians][width]
  float const* gradient = nullptr;     ///< dL/d sums, [R][width]; null on the way forward

  /// Features of a Gaussian, and so of a ray.
  GART_HD int width() const { return features.width; }
  /// The same.
  GART_HD int parameters() const { return features.width; }
  /// Adds the weighted features of a hit.
  GART_HD GART_INLINE void add(listed_hit const& h, int first, int n, float (&sums)[Chunk]) const {
    float const* const row = row_of(features.values, h.id) + first;
    for_each_number<Chunk>(n, [&](int k) { sums[k] += h.weight * row[k]; });
  }
  /// Its features times dL/d the ray's.
  GART_HD GART_INLINE float worth(listed_hit const& h) const {
    float const *const row = row_of(features.values, h.id), *const by = row_of(gradient, h.ray);
    // Eight sums side by side: one would wait for itself at every number.
    float sums[8] = {};
    int k = 0;
    for (; k + 8 <= features.width; k += 8)
      for (int j = 0; j < 8; ++j) sums[j] += row[k + j] * by[k + j];
    for (; k < features.width; ++k) sums[0] += row[k] * by[k];
    return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
  }
  /// Adds the weighted gradient of the hit's ray.
  GART_HD GART_INLINE void pull(listed_hit const& h, int first, int n, float (&sums)[Chunk]) const {
    float const* const by = row_of(gradient, h.ray) + first;
    for_each_number<Chunk>(n, [&](int k) { sums[k] += h.weight * by[k]; });
  }
  /// Asks for that gradient.
  GART_HD GART_INLINE void ask(u32 ray_number, int first, int n) const {
    float const* const by = row_of(gradient, ray_number) + first;
    for (int k = 0; k < n; k += 16) ask_for(by + k);
  }

 private:
  GART_HD GART_INLINE float const* row_of(float const* values, u32 i) const {
    return values + static_cast<std::size_t>(i) * static_cast<std::size_t>(features.width);
  }
};
static_assert(channel<feature_channel<4>>);

}}  // namespace gart::GART_ISA
