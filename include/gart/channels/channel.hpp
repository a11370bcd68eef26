#pragma once
/// \file
/// A channel: what a ray sums besides its colour, over hits that a table has (channels/hit_table.hpp):
///   S = sum over hits of w value + T beyond.
/// Here w is the weight of a hit, and T what the last one lets through. A channel says three things of a hit. What does
/// it add to the ray (add)? What is its weight worth to the loss (worth)? What do its Gaussian's parameters gain
/// (pull)? The passes do the rest, for any channel and any number of them: channels/sum.hpp forward,
/// channels/differentiate.hpp back.
///
/// Colour is the one channel that passes are fused with (render/composite.hpp, backward/): it decides nothing that
/// these need. A new channel is a header here. It has a member in the targets and gradients (rays/ray_batch.hpp) and a
/// line in channels/passes.hpp.
///
/// All channels of a backward pass share one walk of the hits. dL/dalpha needs only the sum of their worths. A channel
/// costs a hit its numbers, read or added once; a wide one goes by chunks of `chunk` numbers.

#include <gart/core/isa.hpp>
#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <concepts>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// A hit as a table has it.
struct listed_hit {
  u32 ray;       ///< its number
  u32 id;        ///< of the Gaussian
  float t;       ///< distance along the ray
  float weight;  ///< transmittance before the hit times alpha
};

/// What a channel is unless it says otherwise: one number, of no parameters.
struct channel_base {
  static constexpr int chunk = 1;       ///< numbers that one lane sums at a time
  static constexpr bool moves = false;  ///< whether along() is anything but zero
  /// Numbers of a ray.
  GART_HD int width() const { return 1; }
  /// Numbers of a Gaussian that have a gradient by this channel.
  GART_HD int parameters() const { return 0; }
  /// w dL/dt: where the value itself is a function of the distance.
  GART_HD float along(listed_hit const&) const { return 0; }
  /// What the light that passes all hits is worth.
  GART_HD float beyond(u32 /*ray*/) const { return 0; }
  /// Asks memory for what pull will read of a ray.
  GART_HD void ask(u32 /*ray*/, int /*first*/, int /*n*/) const {}
  /// Nothing.
  template <int Most>
  GART_HD void pull(listed_hit const&, int /*first*/, int /*n*/, float (&)[Most]) const {}
};

/// A channel, by these members; of channel_base what it does not say itself.
template <class C>
concept channel = std::is_trivially_copyable_v<C> &&
    requires(C const& c, listed_hit const& h, u32 ray, int first, int n, float (&sums)[C::chunk]) {
  { C::moves } -> std::convertible_to<bool>;
  { c.width() } -> std::same_as<int>;
  { c.parameters() } -> std::same_as<int>;
  c.add(h, first, n, sums);               // sums[0..n) += w value, of its numbers [first, first + n)
  { c.worth(h) } -> std::same_as<float>;  // dL/dS . value
  { c.along(h) } -> std::same_as<float>;
  { c.beyond(ray) } -> std::same_as<float>;
  c.ask(ray, first, n);
  c.pull(h, first, n, sums);  // sums[0..n) += w dL/d value, by its parameters [first, first + n)
};

/// Asks memory for what is read soon; on a device other lanes hide that.
GART_HD GART_INLINE void ask_for([[maybe_unused]] void const* p) {
#if !defined(__CUDACC__)
  __builtin_prefetch(p);
#endif
}

/// f(0) to f(n - 1), n at most Most: of a full chunk by a count that compilers know.
template <int Most, class F>
GART_HD GART_INLINE void for_each_number(int n, F&& f) {
  if (n == Most) {
    GART_UNROLL
    for (int k = 0; k < Most; ++k) f(k);
  } else {
    for (int k = 0; k < n; ++k) f(k);
  }
}

}}  // namespace gart::GART_ISA
