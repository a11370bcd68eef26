#pragma once
// The maps of a view beside its photo, at the size of the shrunk photo.

#include "capture.hpp"
#include "codec.hpp"

#include <gart/io/dataset.hpp>

#include <filesystem>

namespace gart::io {

// Reads the mask of a photo of that size. A block with any ignored pixel is ignored.
image8 read_mask(std::filesystem::path const& path, image_size size, int factor);

// Reads distances along the rays of `view`, the photo's camera after options.downscale; 0: not measured. Each block
// gives its middle sample, since a mean at an edge would lie between the surfaces.
image_float read_distances(frame const& f, camera const& view, image_size size, dataset_options const& options);

}  // namespace gart::io
