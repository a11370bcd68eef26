#pragma once
// How a JPEG's EXIF says the camera was held.

#include <gart/core/types.hpp>

#include <vector>

namespace gart::io {

// The EXIF orientation of a JPEG, 1 to 8; 1 if it has none. Orientations 5 to 8 turn it by a quarter for display.
// Pixels are kept as stored, as programs that calibrate cameras keep them.
int exif_orientation(std::vector<u8> const& jpeg);

}  // namespace gart::io
