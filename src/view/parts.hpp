#pragma once
// Renders a view in parts, so that a slow one can be dropped between two. Parts are rows of whole tiles: the bits do
// not depend on the cut.

#include <gart/render/rendered.hpp>
#include <gart/scene/image.hpp>
#include <gart/view/scene.hpp>

#include <algorithm>
#include <optional>
#include <vector>

namespace gart::view {

// Of so many rows, of which all are expected to take so long. Each part prepares the view anew,
// for a twelfth of the whole's time on a CPU: they are few.
inline std::vector<image_rows> parts_of(int height, double milliseconds) {
  constexpr double each_ms = 500;
  constexpr int most = 4, tiles = 32;  // rows, of every size that tiles have
  int const n = std::clamp(static_cast<int>(milliseconds / each_ms), 1, most);
  int const step = std::max(1, (height + n * tiles - 1) / (n * tiles)) * tiles;
  std::vector<image_rows> parts;
  for (int first = 0; first < height; first += step) parts.push_back({first, first + step});
  return parts.size() > 1 ? parts : std::vector<image_rows>{{}};
}

template <class T>
void take_rows(basic_image<T>& to, basic_image<T> const& from, image_rows rows) {
  auto const at = [&](int row) {
    return static_cast<std::ptrdiff_t>(std::min(row, to.height)) * to.width * to.channels;
  };
  std::copy(from.data.begin() + at(rows.first), from.data.begin() + at(rows.end), to.data.begin() + at(rows.first));
}
inline void take_rows(rendered& to, rendered const& from, image_rows rows) {
  take_rows(to.color, from.color, rows), take_rows(to.transmittance, from.transmittance, rows);
  take_rows(to.depth, from.depth, rows), take_rows(to.hits, from.hits, rows);
  if (!from.features.empty()) take_rows(to.features, from.features, rows);
}

// By render(settings), part by part while it is wanted; none where it is not.
template <class Wanted, class Render>
auto in_parts(std::vector<image_rows> const& parts, Wanted const& wanted, view_settings settings, Render const& render)
    -> std::optional<decltype(render(settings))> {
  std::optional<decltype(render(settings))> whole;
  for (image_rows const rows : parts) {
    if (whole && !wanted()) return {};
    settings.rows = rows;
    auto part = render(settings);
    if (whole)
      take_rows(*whole, part, rows);
    else
      whole = std::move(part);
  }
  return whole;
}

}  // namespace gart::view
