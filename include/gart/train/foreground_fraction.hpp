#pragma once
/// \file
/// The share of a capture's pixels that show the scene. The loss is a mean over all pixels. So an object's gradients
/// are proportional to the share of pixels that it covers. On views of the whole sphere that is a fiftieth. A penalty
/// beside the loss must shrink as much, or it fades the object. The penalties were measured on captures that fill a
/// quarter of their images or more (penalty_scale). Cost: a pass over the pixels of at most 32 images, once a run.

#include <gart/core/isa.hpp>
#include <gart/io/dataset.hpp>
#include <gart/train/options.hpp>

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The share of pixels of data.train's `views`, by index, that count in the loss and differ from the background. It is
/// at least a thousandth. Reads some views, evenly spread. Before a random background only transparent pixels are
/// empty.
inline double foreground_fraction(dataset const& data, std::vector<std::size_t> const& views,
                                  background_kind background) {
  constexpr std::size_t most_views = 32;
  constexpr int alike = 12;  // of 255, a channel
  int const empty = background == background_kind::white ? 255 : 0;
  bool const opaque_may_be_empty = background != background_kind::random;
  std::size_t shown = 0, pixels = 0;
  for (std::size_t k = 0; k < views.size(); k += (views.size() + most_views - 1) / most_views) {
    dataset_view const& view = data.train[views[k]];
    std::size_t const channels = static_cast<std::size_t>(view.image.channels);
    std::size_t const count = channels ? view.image.data.size() / channels : 0;
    for (std::size_t i = 0; i < count; ++i) {
      u8 const* const p = &view.image.data[channels * i];
      int const alpha = channels == 4 ? p[3] : 255;
      bool differs = !opaque_may_be_empty && alpha > alike;
      for (int c = 0; c < 3 && opaque_may_be_empty; ++c)
        differs = differs || std::abs(p[c] - empty) * alpha > alike * 255;
      shown += differs && (view.mask.empty() || view.mask.data[i] != 0);
    }
    pixels += count;
  }
  return pixels ? std::max(static_cast<double>(shown) / static_cast<double>(pixels), 1e-3) : 1.0;
}

/// The factor of a penalty for a capture whose scene fills such a share of its images.
inline float penalty_scale(double share) { return static_cast<float>(std::min(1.0, 4 * share)); }

}}  // namespace gart::GART_ISA
