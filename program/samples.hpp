#pragma once
// A view with many rays a pixel, for the mean over a pixel's square.

#include <gart/runtime/renderer.hpp>

namespace gart_cli {

// n x n rays a pixel, evenly spread. Renders as many images, with the principal point moved by parts of a pixel.
// Returns their mean (colour, transmittance, depth; no hits). Any camera with a principal point. The pixels' filter is
// that of the smaller squares. Memory: one image more.
gart::rendered render_samples(gart::renderer& renderer, gart::camera const& view, gart::render_options options, int n);

}  // namespace gart_cli
