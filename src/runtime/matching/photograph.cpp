#include "photograph.hpp"

#include <gart/camera/models.hpp>

#include <algorithm>
#include <cmath>

namespace gart::matching {

namespace {

constexpr int longest_side = 512;  // pixels of a shrunk photograph
constexpr int spacing = 8;         // pixels between the nodes of a lens' grid
constexpr float nowhere = -1e6f;

// Means over blocks; 0 where a pixel of the block is masked or transparent.
std::vector<u8> levels_of(dataset_view const& v, int shrink, int width, int height) {
  image8 const& image = v.image;
  auto const known = [&](int x, int y) {
    return !(image.channels == 4 && image.at(x, y, 3) < 128) && (v.mask.empty() || v.mask.at(x, y, 0) != 0);
  };
  auto const grey = [&](int x, int y) {
    if (image.channels < 3) return static_cast<float>(image.at(x, y, 0));
    return 0.299f * image.at(x, y, 0) + 0.587f * image.at(x, y, 1) + 0.114f * image.at(x, y, 2);
  };
  std::vector<u8> out;
  out.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      bool all = true;
      for (int j = y * shrink; j < (y + 1) * shrink; ++j)
        for (int i = x * shrink; i < (x + 1) * shrink; ++i) sum += grey(i, j), all = all && known(i, j);
      float const mean = sum / static_cast<float>(shrink * shrink);
      out.push_back(all ? static_cast<u8>(std::clamp(mean + 0.5f, 1.0f, 255.0f)) : u8{0});
    }
  }
  return out;
}

// The image point where a lens shows a direction. A pinhole's step for what is left of the slopes, again and again;
// lenses are near enough to pinholes for that.
std::optional<point2> shown_at(camera const& c, vec3 const& slopes) {
  float u = c.cx + c.fx * slopes.x, v = c.cy + c.fy * slopes.y;
  for (int k = 0; k < 30; ++k) {
    vec3 const d = ray_direction(c, u, v) * c.rotation;
    if (!(d.z > 0.05f)) return {};
    float const du = c.fx * (slopes.x - d.x / d.z), dv = c.fy * (slopes.y - d.y / d.z),
                step = std::fabs(du) + std::fabs(dv);
    if (!(step < 1e5f)) return {};
    u += du, v += dv;
    if (step < 0.02f) return point2{u, v};
  }
  return {};
}

// Between four pixels; 0 where one of them is unknown.
float level_between(std::vector<u8> const& level, int width, int height, point2 const& at) {
  float const x = at.x - 0.5f, y = at.y - 0.5f;
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(width - 1) && y < static_cast<float>(height - 1))) return 0;
  int const i = static_cast<int>(x), j = static_cast<int>(y);
  float const a = x - static_cast<float>(i), b = y - static_cast<float>(j);
  u8 const* const p = &level[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + i];
  if (!p[0] || !p[1] || !p[width] || !p[width + 1]) return 0;
  return (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * p[width] + a * p[width + 1]);
}

}  // namespace

photograph::photograph(dataset_view const& view) {
  camera const& c = view.view;
  if (view.image.empty() || c.kind == camera_kind::equirectangular || c.kind == camera_kind::orthographic) return;
  shrink = (std::max(c.width, c.height) + longest_side - 1) / longest_side;
  width = c.width / shrink, height = c.height / shrink;
  if (width < 1 || height < 1) return;
  float const share = 1.0f / static_cast<float>(shrink);
  fx = c.fx * share, fy = c.fy * share, cx = c.cx * share, cy = c.cy * share;
  rotation = c.rotation, position = c.position;
  level = levels_of(view, shrink, width, height);
  if (c.kind != camera_kind::perspective || c.lens.any()) see_through_pinhole(c);
}

void photograph::see_through_pinhole(camera const& lens) {
  columns_ = width / spacing + 2;
  float const share = 1.0f / static_cast<float>(shrink);
  for (int y = 0; y < (height / spacing + 2) * spacing; y += spacing) {
    for (int i = 0; i < columns_; ++i) {
      auto const at = shown_at(lens, slopes(static_cast<float>(i * spacing), static_cast<float>(y)));
      lens_.push_back(at ? point2{at->x * share, at->y * share} : point2{nowhere, nowhere});
    }
  }
  std::vector<u8> seen;
  seen.reserve(level.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      point2 const at = through_lens(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      seen.push_back(static_cast<u8>(level_between(level, width, height, at) + 0.5f));
    }
  }
  level = std::move(seen);
}

point2 photograph::through_lens(float x, float y) const {
  if (lens_.empty()) return {x, y};
  int const i = static_cast<int>(x) / spacing, j = static_cast<int>(y) / spacing;
  float const a = x / spacing - static_cast<float>(i), b = y / spacing - static_cast<float>(j);
  point2 const* const p = &lens_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + i];
  auto const between = [&](float point2::*of) {
    return (1 - b) * ((1 - a) * p[0].*of + a * p[1].*of) + b * ((1 - a) * p[columns_].*of + a * p[columns_ + 1].*of);
  };
  return {between(&point2::x), between(&point2::y)};
}

point2 photograph::taken_at(float x, float y) const {
  point2 const at = through_lens(x, y);
  return {at.x * static_cast<float>(shrink), at.y * static_cast<float>(shrink)};
}

}  // namespace gart::matching
