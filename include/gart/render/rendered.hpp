#pragma once
/// \file
/// What rendering leaves in host memory: an image and everything else that a pixel can tell, [H][W][channels] each.

#include <gart/scene/image.hpp>

namespace gart {

/// One view in host memory.
struct rendered {
  image_float color;          ///< background composited
  image_float transmittance;  ///< 1 channel
  image_float depth;          ///< 1 channel: sum of weight * t
  basic_image<u32> hits;      ///< 1 channel: hits composited
  image_float features = {};  ///< a channel each, where they are asked for: sum of weight * features
};

}  // namespace gart
