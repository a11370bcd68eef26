#pragma once
/// \file
/// A gradient method says what the forward pass records of a hit. It also says which terms of the gradient are gathered
/// by primitive and which are scattered by pixel. It derives from gradient_method_base, which has defaults. A program
/// static_asserts `gradient_method` of its own where it defines it; a misspelt name is found there.

#include <gart/backward/terms.hpp>
#include <gart/render/record.hpp>

#include <concepts>

namespace gart { inline namespace GART_ISA {

/// How a slot that no hit wrote is told from a hit. `cleared`: the buffer holds NaN before every forward pass.
/// `recomputed`: the forward pass's function evaluates each pixel of a box again, and compares it with its ray's last
/// hit. The decision is the same, bit for bit, and nothing is cleared. It measured better on a device and on a host
/// (docs/backward.md).
enum class slot_validity { cleared, recomputed };

/// The defaults of a method.
struct gradient_method_base {
  static constexpr bool ordered = false;       ///< sums in a fixed order: the same bits in every run
  static constexpr bool lane_by_lane = false;  ///< by the plain gather, whatever the policy (backward/gather_form.hpp)
  static constexpr slot_validity validity = slot_validity::cleared;  ///< how slots of hits are recognised
  using fallback = void;  ///< the method that a step is done by where the hit buffer has no room
};

/// A gradient method, by these members.
template <class S>
concept gradient_method = requires {
  { S::name } -> std::convertible_to<char const*>;  // what programs and reports call it
  typename S::template record<8>;                   // by tile size: a hit_record (render/record.hpp)
  typename S::gather;                               // terms<...>: summed by primitive, from what was recorded
  typename S::scatter;                              // terms<...>: added by pixel, as the rays are traced again
  // From gradient_method_base:
  { S::ordered } -> std::convertible_to<bool>;
  { S::lane_by_lane } -> std::convertible_to<bool>;
  { S::validity } -> std::convertible_to<slot_validity>;
  typename S::fallback;
  // Each term once, and a record where there is something to gather.
  requires hit_record<typename S::template record<8>>;
  requires S::gather::color != S::scatter::color;
  requires S::gather::geometry != S::scatter::geometry;
  requires S::gather::any == S::template record<8>::any;
};

}}  // namespace gart::GART_ISA
