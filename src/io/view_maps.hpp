#pragma once
// What a capture has of a view beside its photo, at the size that the photo is made smaller to.

#include "capture.hpp"
#include "codec.hpp"

#include <gart/io/dataset.hpp>

#include <filesystem>

namespace gart::io {

// The mask of a photo of that size. A block of which any pixel is ignored is ignored.
image8 read_mask(std::filesystem::path const& path, image_size size, int factor);

// Distances along the rays of `view`, the camera of the photo made smaller by options.downscale: the sample in the
// middle of each block, for a mean would lie between the surfaces at an edge. 0 where nothing was measured.
image_float read_distances(frame const& f, camera const& view, image_size size, dataset_options const& options);

}  // namespace gart::io
