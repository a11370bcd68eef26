#pragma once
// What the forward pass leaves of each hit for the backward pass to find. A record is called once a hit, after it has
// been composited, with the ray's accumulated colour, the hit's weight T alpha and its own colour before the clamp; it
// is part of a strategy (backward/strategies.hpp). Where many pixels of a tile meet one Gaussian, the place of its hits
// there can be asked for once and written to many times.

#include <gart/math/footprint.hpp>
#include <gart/render/pixels.hpp>
#include <gart/trace/hit.hpp>

namespace gart {

// Nothing: the backward pass traces again.
struct record_none {
  GART_HD GART_INLINE void operator()(pixel, hit const&, vec3 const& /*color*/, float /*weight*/,
                                      vec3 const& /*unclamped*/) const {}

  struct place {};
  static constexpr bool any = false;
  place place_of(u32, pixel_box const&) const { return {}; }
  void operator()(place const&, pixel, vec3 const&, float, vec3 const&) const {}
};

}  // namespace gart
