#pragma once
/// \file
/// The size of a step's images. Early in a run Gaussians are few and large. Images of a quarter or half of the width
/// place them as well. They take a sixteenth or a quarter of the rays. Detail is learned at full size (compare Chen et
/// al., DashGaussian, CVPR 2025). Each size is half the next, so a pixel is the mean of a block of the photograph's
/// pixels.

#include <gart/scene/camera.hpp>
#include <gart/train/options.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// Pixels of a photograph, across and down, to one of the image of step `step`: 1, 2 or 4.
inline int shrink_at(resolution_options const& options, int step, int iterations) {
  float const share = static_cast<float>(step) / static_cast<float>(std::min(iterations, options.long_run));
  return share < options.quarter_until ? 4 : share < options.half_until ? 2 : 1;
}

/// Steps of a run whose photographs are at least so many times smaller.
inline int steps_shrunk(resolution_options const& options, int shrink, int iterations) {
  int step = 0;
  while (step < iterations && shrink_at(options, step, iterations) >= shrink) ++step;
  return step;
}

/// The largest shrink, up to the given one, that this camera's image allows. A view of the whole sphere cannot be
/// cropped to whole blocks.
inline int shrink_of(camera const& c, int shrink, resolution_options const& options) {
  auto const fits = [&](int by) {
    bool const whole = c.kind != camera_kind::equirectangular || (c.width % by == 0 && c.height % by == 0);
    return whole && c.width / by >= options.least && c.height / by >= options.least;
  };
  while (shrink > 1 && !fits(shrink)) shrink /= 2;
  return shrink;
}

}}  // namespace gart::GART_ISA
