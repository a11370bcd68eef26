#pragma once
// What a JPEG says of how it was held.

#include <gart/core/types.hpp>

#include <vector>

namespace gart::io {

// The EXIF orientation of a JPEG, 1 to 8; 1 where it says none. 5 to 8 turn it by a quarter to be seen upright. gart
// leaves pixels as they are stored, as programs that calibrate cameras do.
int exif_orientation(std::vector<u8> const& jpeg);

}  // namespace gart::io
