#pragma once
// How a JPEG's EXIF says the camera was held.

#include <gart/core/types.hpp>

#include <vector>

namespace gart::io {

// The EXIF orientation of a JPEG, 1 to 8; 1 if it has none. 5 to 8 turn it by a quarter for display. gart keeps pixels
// as stored, like programs that calibrate cameras.
int exif_orientation(std::vector<u8> const& jpeg);

}  // namespace gart::io
