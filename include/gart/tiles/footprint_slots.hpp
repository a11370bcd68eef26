#pragma once
/// \file
/// The footprint of a Gaussian in a view: its box of pixels, and how many pixels the boxes before it have, which is
/// where its own begin in a buffer with a slot for each (backward/lt_layout.hpp).

#include <gart/tiles/grid.hpp>

namespace gart::inline GART_ISA {

/// One 16-byte word.
struct alignas(16) footprint_slots {
  u64 offset = 0;  ///< slots before its own
  pixel_box box;   ///< its pixels
};

}  // namespace gart::inline GART_ISA
