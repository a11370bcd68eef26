#pragma once
/// \file
/// The record of each hit that the forward pass leaves for the backward pass; part of a method
/// (backward/gradient_method.hpp). A record says where a hit belongs when it is found. It is called once a hit, after
/// compositing. On hosts it also takes a hit of each ray of a packet at once (trace/packet_walk.hpp).

#include <gart/render/pixels.hpp>
#include <gart/trace/hit.hpp>
#include <gart/trace/packet_program.hpp>
#include <gart/trace/warp_program.hpp>

#include <concepts>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

namespace detail {

#if defined(__CUDACC__)
template <class R>
concept packet_record = true;
#else
template <class R>
concept packet_record = requires(R const& r, packet_block const& block, typename R::packet_cell const& cell,
                                 lane_words places, lane_mask hits, vec3_of<lanes> const& color, lanes x) {
  typename R::packet_cell;                                // as packet_program has it
  { r.expect(cell, block) } -> std::same_as<lane_words>;  // the places of the packet's pixels
  r(places, hits, color, x, color);                       // as below, for the hits of a mask
};
#endif

}  // namespace detail

/// The data of a hit that the forward pass leaves.
template <class R>
concept hit_record = std::is_trivially_copyable_v<R> &&
    requires(R const& r, u32 id, pixel at, u32 place, vec3 const& color, float weight) {
  { R::any } -> std::convertible_to<bool>;      // whether anything is left; places then order a pixel's hits by id
  { R::depth } -> std::convertible_to<bool>;    // whether it also takes, as a last argument, the depth as below
  typename R::entry;                            // what a place holds, with a `name`
  typename R::cell;                             // as warp_program has it
  { r.place_of(id, at) } -> std::same_as<u32>;  // where the hit of Gaussian `id` at that pixel belongs
  // The colour that the pixel would have if the hit were opaque. Then the hit's weight T alpha and its colour before
  // the clamp. A record with depth also has the pixel's depth if the hit were opaque.
  r(place, color, weight, color);
} && detail::packet_record<R>;

/// The entry of a record that keeps nothing.
struct no_entry {
  static constexpr char const* name = "none";  ///< in configurations and reports
};

/// Nothing: the backward pass traces again.
struct record_none {
  static constexpr bool any = false;    ///< nothing is left
  static constexpr bool depth = false;  ///< of depth neither
  using entry = no_entry;               ///< nothing
  using cell = no_cell;                 ///< hits have no places
  /// Always 0.
  GART_HD GART_INLINE u32 place_of(u32 /*id*/, pixel) const { return 0; }
  /// Does nothing.
  GART_HD GART_INLINE void operator()(u32 /*place*/, vec3 const& /*opaque*/, float /*weight*/,
                                      vec3 const& /*unclamped*/) const {}

#if !defined(__CUDACC__)
  using packet_cell = gart::packet_cell;  ///< with nothing to add
  /// Always 0.
  lane_words expect(packet_cell const&, packet_block const&) const { return every_lane(0); }
  /// Does nothing.
  void operator()(lane_words, lane_mask, vec3_of<lanes> const&, lanes, vec3_of<lanes> const&) const {}
#endif
};
static_assert(hit_record<record_none>);

}}  // namespace gart::GART_ISA
