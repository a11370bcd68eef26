#pragma once
/// \file
/// Starting points for a capture, found by matching its photographs with each other, as stereo does. Poses are known.
/// So the point of a pixel lies on a line, and only its depth is open. At each of up to 256 depths the pixel's
/// surroundings are compared with what five other photographs show there, by normalised cross-correlation. A depth is
/// taken where three of them agree, where no other depth agrees nearly as well, and where their rays meet at an angle
/// of a degree or more. Some points are wrong all the same. Training drops these, and dense points are worth more to it
/// than clean ones: a check from the second photograph's side takes a third of both, and cost 0.4 to 1.3 dB.
///
/// Random points lie mostly in empty space. Where cameras move through a scene, few are where surfaces are. Gaussians
/// in front of the cameras then explain each photograph by itself (docs/training.md).
///
/// Photographs are shrunk to at most 512 pixels a side, and seen through a pinhole of their lens' focal length. So of
/// a wide lens the middle counts. Images of the whole sphere, and of parallel rays, take no part. Masked and
/// transparent pixels give no points. Cost: 100 to 200 us a pixel on one thread; all cores take part, and the points do
/// not depend on their number. Memory: a byte a pixel of the shrunk photographs.

#include <gart/io/dataset.hpp>

#include <functional>

namespace gart {

/// Called with the share done, from one thread.
using matching_progress = std::function<void(double done)>;

/// The points of so many pixels of the training views, drawn at random, with the photographs' colours: on photographs
/// with texture one for every two to ten pixels. Fewer than four views that look the same way have none. The same for
/// the same seed.
point_cloud match_photographs(dataset const& data, index_t pixels, u64 seed, matching_progress const& progress = {});

}  // namespace gart
