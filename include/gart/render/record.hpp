#pragma once
// What the forward pass leaves of each hit for the backward pass to find. A record says where a hit belongs (place_of,
// when it is found) and is called once a hit, after it has been composited, with that place, the colour
// that the pixel would have if the hit were opaque, its weight T alpha and its own colour before the clamp; it is part
// of a strategy (backward/strategies.hpp). On hosts it also takes the hits of one Gaussian with a packet of rays at
// once (trace/packet_walk.hpp), by the note it made when they were found, and says their places.

#include <gart/render/pixels.hpp>
#include <gart/tiles/layout.hpp>
#include <gart/trace/hit.hpp>
#include <gart/trace/packet_cell.hpp>

#include <concepts>
#include <type_traits>

namespace gart::inline GART_ISA {

template <class R>
concept hit_record = std::is_trivially_copyable_v<R> &&
    requires(R const& r, u32 id, pixel at, vec3 const& color, float weight) {
  { R::any } -> std::convertible_to<bool>;      // whether anything is left
  { r.place_of(id, at) } -> std::same_as<u32>;  // where the hit of Gaussian `id` at that pixel belongs
  r(u32{}, color, weight, color);               // place, colour were it opaque, weight, its colour before the clamp
};

// Nothing: the backward pass traces again.
struct record_none {
  static constexpr bool any = false;
  GART_HD GART_INLINE u32 place_of(u32 /*id*/, pixel) const { return 0; }
  GART_HD GART_INLINE void operator()(u32 /*place*/, vec3 const& /*opaque*/, float /*weight*/,
                                      vec3 const& /*unclamped*/) const {}

#if !defined(__CUDACC__)
  struct note {};
  note expect(packet_cell const&, packet_block const&) const { return {}; }
  lane_words operator()(note, lane_mask, vec3_of<lanes> const&, lanes, vec3_of<lanes> const&) const {
    return every_lane(0);
  }
#endif
};

}  // namespace gart::inline GART_ISA
