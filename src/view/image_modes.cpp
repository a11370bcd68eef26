#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/image_modes.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <vector>

namespace gart {

namespace {

// From near to far, or from few to many: yellow, orange, violet, dark blue.
vec3 shade_of(float x) {
  vec3 const stops[] = {{0.98f, 0.95f, 0.55f}, {0.96f, 0.55f, 0.25f}, {0.62f, 0.22f, 0.50f}, {0.10f, 0.08f, 0.32f}};
  float const at = std::clamp(x, 0.0f, 1.0f) * 3;
  int const i = std::min(2, static_cast<int>(at));
  return stops[i] + (at - static_cast<float>(i)) * (stops[i + 1] - stops[i]);
}

u8 mixed(u8 a, u8 b, float f) {
  return static_cast<u8>(static_cast<float>(a) + f * (static_cast<float>(b) - static_cast<float>(a)));
}

// Between the four pixels about an image point, on the edge the nearest ones; straight alpha over the background.
vec3 sampled(image8 const& photo, float x, float y, vec3 background) {
  float const u = std::clamp(x - 0.5f, 0.0f, static_cast<float>(photo.width - 1)),
              v = std::clamp(y - 0.5f, 0.0f, static_cast<float>(photo.height - 1));
  int const i = static_cast<int>(u), j = static_cast<int>(v);
  auto const pixel = [&](int a, int b) {
    a = std::min(a, photo.width - 1), b = std::min(b, photo.height - 1);
    float const alpha = photo.channels == 4 ? static_cast<float>(photo.at(a, b, 3)) / 255 : 1.0f;
    vec3 c;
    for (int k = 0; k < 3; ++k)
      c[k] = alpha * static_cast<float>(photo.at(a, b, photo.channels < 3 ? 0 : k)) / 255 + (1 - alpha) * background[k];
    return c;
  };
  float const f = u - static_cast<float>(i), g = v - static_cast<float>(j);
  vec3 const top = (1 - f) * pixel(i, j) + f * pixel(i + 1, j),
             bottom = (1 - f) * pixel(i, j + 1) + f * pixel(i + 1, j + 1);
  return (1 - g) * top + g * bottom;
}

}  // namespace

std::pair<float, float> range_of(image_float const& map) {
  float least = std::numeric_limits<float>::max(), largest = 0;
  for (float const v : map.data)
    if (v > 0) least = std::min(least, v), largest = std::max(largest, v);
  return {largest > 0 ? least : 0.0f, largest};
}

image8 in_colors(image_float const& map, float low, float high) {
  image_float out(map.width, map.height, 3);
  float const range = std::max(high - low, 1e-6f * high);
  for (std::size_t p = 0; p < map.data.size(); ++p) {
    if (!(map.data[p] > 0)) continue;
    vec3 const c = shade_of((map.data[p] - low) / range);
    for (int k = 0; k < 3; ++k) out.data[3 * p + static_cast<std::size_t>(k)] = c[k];
  }
  return to_8bit(out);
}

image_float mean_distances(rendered const& r) {
  image_float map(r.depth.width, r.depth.height, 1);
  for (std::size_t p = 0; p < map.data.size(); ++p) {
    float const seen = 1 - r.transmittance.data[p];
    if (seen >= 0.5f) map.data[p] = r.depth.data[p] / seen;
  }
  return map;
}

image_float normals_of(image_float const& distances, camera const& view) {
  image_float out(distances.width, distances.height, 3);
  std::vector<vec3> point(distances.data.size()), direction(distances.data.size());
  for (int y = 0; y < distances.height; ++y)
    for (int x = 0; x < distances.width; ++x) {
      ray const r = ray_through(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      std::size_t const at = static_cast<std::size_t>(y) * distances.width + x;
      point[at] = r.origin + distances.at(x, y, 0) * r.direction, direction[at] = r.direction;
    }
  // The difference to the neighbour that lies at the more alike distance, so that an edge is no slope.
  auto const along = [&](int x, int y, int dx, int dy, vec3& d) {
    auto const inside = [&](int s) {
      int const u = x + s * dx, v = y + s * dy;
      return u >= 0 && v >= 0 && u < distances.width && v < distances.height && distances.at(u, v, 0) > 0;
    };
    auto const place = [&](int s) { return static_cast<std::size_t>(y + s * dy) * distances.width + (x + s * dx); };
    auto const step = [&](int s) { return std::abs(distances.data[place(s)] - distances.at(x, y, 0)); };
    bool const after = inside(1), before = inside(-1);
    if (!after && !before) return false;
    d = after && (!before || step(1) <= step(-1)) ? point[place(1)] - point[place(0)]
                                                  : point[place(0)] - point[place(-1)];
    return true;
  };
  for (int y = 0; y < distances.height; ++y) {
    for (int x = 0; x < distances.width; ++x) {
      vec3 right, down;
      if (!(distances.at(x, y, 0) > 0) || !along(x, y, 1, 0, right) || !along(x, y, 0, 1, down)) continue;
      vec3 n = glm::cross(down, right);
      float const length = std::sqrt(glm::dot(n, n));
      if (!(length > 0)) continue;
      n = n / length;
      if (glm::dot(n, direction[static_cast<std::size_t>(y) * distances.width + x]) > 0) n = -n;
      for (int c = 0; c < 3; ++c) out.at(x, y, c) = n[c];
    }
  }
  return out;
}

image_float normal_colors(image_float normals) {
  for (std::size_t p = 0; p < normals.data.size(); p += 3) {
    float* const n = &normals.data[p];
    if (n[0] != 0 || n[1] != 0 || n[2] != 0)
      for (int c = 0; c < 3; ++c) n[c] = 0.5f + 0.5f * n[c];
  }
  return normals;
}

image_float alpha_of(rendered const& r) {
  image_float alpha(r.transmittance.width, r.transmittance.height, 1);
  for (std::size_t p = 0; p < alpha.data.size(); ++p) alpha.data[p] = 1 - r.transmittance.data[p];
  return alpha;
}

image_float hits_of(rendered const& r) {
  image_float hits(r.hits.width, r.hits.height, 1);
  std::transform(r.hits.data.begin(), r.hits.data.end(), hits.data.begin(),
                 [](u32 n) { return static_cast<float>(n); });
  return hits;
}

image8 error_in_colors(image_float const& map, float high) {
  image8 out(map.width, map.height, 3);
  constexpr int last = static_cast<int>(std::size(error_colors)) - 1;
  for (std::size_t p = 0; p < map.data.size(); ++p) {
    float const at = std::clamp(map.data[p] / high, 0.0f, 1.0f) * last;
    int const i = std::min(static_cast<int>(at), last - 1);
    for (std::size_t k = 0; k < 3; ++k)
      out.data[3 * p + k] = mixed(error_colors[i][k], error_colors[i + 1][k], at - static_cast<float>(i));
  }
  return out;
}

image8 features_in_colors(rendered const& r) {
  image_float out(r.transmittance.width, r.transmittance.height, 3);
  std::size_t const channels = static_cast<std::size_t>(r.features.channels);
  for (std::size_t p = 0; p < r.transmittance.data.size(); ++p) {
    float const seen = 1 - r.transmittance.data[p];
    if (!(seen >= 0.5f)) continue;
    float const* const own = &r.features.data[channels * p];
    vec3 const c = channels == 1 ? shade_of(own[0] / seen) : vec3(own[0], own[1], own[2]) / seen;
    for (int k = 0; k < 3; ++k) out.data[3 * p + static_cast<std::size_t>(k)] = std::clamp(c[k], 0.0f, 1.0f);
  }
  return to_8bit(out);
}

image_float error_between(image_float const& color, image8 const& photo, vec3 background) {
  image_float out(color.width, color.height, 1);
  float const sx = static_cast<float>(photo.width) / static_cast<float>(color.width),
              sy = static_cast<float>(photo.height) / static_cast<float>(color.height);
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      vec3 const c =
          sampled(photo, (static_cast<float>(x) + 0.5f) * sx, (static_cast<float>(y) + 0.5f) * sy, background);
      float sum = 0;
      for (int k = 0; k < 3; ++k) sum += std::abs(color.at(x, y, k) - c[k]);
      out.at(x, y, 0) = sum / 3;
    }
  }
  return out;
}

shown_image shown(rendered const& r, camera const& view, view_mode mode, image8 const* photo, vec3 background) {
  shown_image out;
  switch (mode) {
    case view_mode::colour:
      out.image = to_8bit(r.color);
      break;
    case view_mode::depth: {
      image_float const map = mean_distances(r);
      std::tie(out.low, out.high) = range_of(map);
      out.image = in_colors(map, out.low, out.high);
      break;
    }
    case view_mode::normal:
      out.image = to_8bit(normal_colors(normals_of(mean_distances(r), view)));
      break;
    case view_mode::alpha:
      out.high = 1;
      out.image = to_8bit(alpha_of(r));
      break;
    case view_mode::hits: {
      image_float const map = hits_of(r);
      out.high = range_of(map).second;
      out.image = in_colors(map, 0, out.high);
      break;
    }
    case view_mode::error:
      if (!photo || photo->empty())
        throw invalid_argument("view_mode::error: there is no photograph of this view (name a camera that has one)");
      out.high = default_error_scale;
      out.image = error_in_colors(error_between(r.color, *photo, background), out.high);
      break;
    case view_mode::features:
      if (r.features.channels != 1 && r.features.channels != 3)
        throw invalid_argument("view_mode::features: there are no features to show (give one or three)");
      out.high = 1;
      out.image = features_in_colors(r);
      break;
  }
  return out;
}

}  // namespace gart
