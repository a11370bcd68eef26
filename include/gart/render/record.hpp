#pragma once
// What the forward pass leaves of each hit for the backward pass to find. A record says where a hit belongs (place_of,
// when it is found) and is called once a hit, after it has been composited, with that place, the colour
// that the pixel would have if the hit were opaque, its weight T alpha and its own colour before the clamp; it is part
// of a strategy (backward/strategies.hpp). Where many pixels of a tile meet one Gaussian, the cell of its hits there
// can be asked for once and written to many times.

#include <gart/render/pixels.hpp>
#include <gart/tiles/layout.hpp>
#include <gart/trace/hit.hpp>

namespace gart {

// Nothing: the backward pass traces again.
struct record_none {
  static constexpr bool any = false;
  GART_HD GART_INLINE u32 place_of(u32 /*id*/, pixel) const { return 0; }
  GART_HD GART_INLINE void operator()(u32 /*place*/, vec3 const& /*opaque*/, float /*weight*/,
                                      vec3 const& /*unclamped*/) const {}

  struct cell {};
  cell cell_of(u32, pixel_box const&) const { return {}; }
  u32 place_of(cell const&, pixel) const { return 0; }
  void operator()(cell const&, pixel, vec3 const&, float, vec3 const&) const {}
};

}  // namespace gart
