#pragma once
// A view with many rays a pixel: the mean over a pixel's square, which one ray through its middle only estimates.

#include <gart/runtime/renderer.hpp>

namespace gart_cli {

// n x n rays a pixel, evenly spread over it: as many images, each of a camera whose principal point lies a part of a
// pixel aside, and their mean (colour, transmittance, depth; no hits). Any camera that has one, its lens included. The
// pixels' filter is that of the smaller squares. Memory: of one image more.
gart::rendered render_samples(gart::renderer& renderer, gart::camera const& view, gart::render_options options, int n);

}  // namespace gart_cli
