#include "samples.hpp"

namespace gart_cli {

gart::rendered render_samples(gart::renderer& renderer, gart::camera const& view, gart::render_options options, int n) {
  if (n == 1) return renderer.render(view, options);
  options.antialias /= static_cast<float>(n);
  gart::rendered mean;
  auto const share = 1 / (static_cast<float>(n) * static_cast<float>(n));
  auto const add = [share](gart::image_float const& part, gart::image_float& sum) {
    if (sum.data.empty()) sum = gart::image_float(part.width, part.height, part.channels);
    for (std::size_t i = 0; i < part.data.size(); ++i) sum.data[i] += share * part.data[i];
  };
  for (int k = 0; k < n * n; ++k) {
    gart::camera aside = view;
    aside.cx -= (static_cast<float>(k % n) + 0.5f) / static_cast<float>(n) - 0.5f;
    aside.cy -= (static_cast<float>(k / n) + 0.5f) / static_cast<float>(n) - 0.5f;
    gart::rendered const part = renderer.render(aside, options);
    add(part.color, mean.color), add(part.transmittance, mean.transmittance), add(part.depth, mean.depth);
  }
  return mean;
}

}  // namespace gart_cli
