#include "render_images.hpp"

#include "commands.hpp"

#include <gart/camera/models.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <sstream>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;
using gart::image_float;
using gart::vec3;

std::vector<std::string> parts_of(std::string const& list) {
  std::vector<std::string> parts;
  std::istringstream text(list);
  for (std::string one; std::getline(text, one, ',');) parts.push_back(one);
  return parts;
}

// From near to far, or from few to many: yellow, orange, violet, dark blue.
vec3 shade_of(float x) {
  vec3 const stops[] = {{0.98f, 0.95f, 0.55f}, {0.96f, 0.55f, 0.25f}, {0.62f, 0.22f, 0.50f}, {0.10f, 0.08f, 0.32f}};
  float const at = std::clamp(x, 0.0f, 1.0f) * 3;
  int const i = std::min(2, static_cast<int>(at));
  return stops[i] + (at - static_cast<float>(i)) * (stops[i + 1] - stops[i]);
}

// The least and the largest value above 0; zeros where there is none.
std::pair<float, float> range_of(image_float const& map) {
  float least = std::numeric_limits<float>::max(), largest = 0;
  for (float const v : map.data)
    if (v > 0) least = std::min(least, v), largest = std::max(largest, v);
  return {largest > 0 ? least : 0.0f, largest};
}

// In colours over that range; black where there is nothing.
gart::image8 preview_of(image_float const& map, float least, float largest) {
  image_float out(map.width, map.height, 3);
  float const range = std::max(largest - least, 1e-6f * largest);
  for (std::size_t p = 0; p < map.data.size(); ++p) {
    if (!(map.data[p] > 0)) continue;
    vec3 const c = shade_of((map.data[p] - least) / range);
    for (int k = 0; k < 3; ++k) out.data[3 * p + static_cast<std::size_t>(k)] = c[k];
  }
  return gart::to_8bit(out);
}

// 16 bits hold 65535 steps.
void check_steps(std::string const& name, char const* what, double largest, double unit, char const* remedy) {
  if (largest <= 65535 * unit) return;
  char text[160];
  std::snprintf(text, sizeof text, "%s: its %s goes to %.6g, and 16 bits end at %.6g (%s)", name.c_str(), what, largest,
                65535 * unit, remedy);
  throw usage_error(text);
}

}  // namespace

std::vector<std::string> const& image_choice::names() {
  static std::vector<std::string> const all{"colour", "depth", "normal", "alpha", "hits"};
  return all;
}

bool image_choice::has(std::string const& name) const {
  auto const chosen = parts_of(images);
  return std::find(chosen.begin(), chosen.end(), name) != chosen.end();
}

void check_images(image_choice const& choice) {
  auto const& names = image_choice::names();
  auto const chosen = parts_of(choice.images);
  if (chosen.empty()) throw usage_error("--images: name one of colour, depth, normal, alpha, hits");
  for (std::string const& one : chosen)
    if (std::find(names.begin(), names.end(), one) == names.end())
      throw usage_error("--images " + one + ": there is no such image; there are colour, depth, normal, alpha, hits");
}

image_float mean_distances(gart::rendered const& r) {
  image_float map(r.depth.width, r.depth.height, 1);
  for (std::size_t p = 0; p < map.data.size(); ++p) {
    float const seen = 1 - r.transmittance.data[p];
    if (seen >= 0.5f) map.data[p] = r.depth.data[p] / seen;
  }
  return map;
}

image_float normals_of(image_float const& distances, gart::camera const& view) {
  image_float out(distances.width, distances.height, 3);
  std::vector<vec3> point(distances.data.size()), direction(distances.data.size());
  for (int y = 0; y < distances.height; ++y)
    for (int x = 0; x < distances.width; ++x) {
      gart::ray const r = gart::ray_through(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
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

void write_images(fs::path const& folder, std::string const& name, gart::rendered const& image,
                  gart::camera const& view, image_choice const& choice, nlohmann::json& entry) {
  bool const npy = choice.format == "npy";
  auto const file = [&](char const* what) { return folder / (name + "_" + what + (npy ? ".npy" : ".png")); };
  auto const preview = [&](char const* what) { return folder / (name + "_" + what + "_preview.png"); };
  if (choice.has("depth") || choice.has("normal")) {
    image_float const map = mean_distances(image);
    if (choice.has("depth")) {
      auto const [nearest, farthest] = range_of(map);
      if (npy) {
        gart::write_npy(file("depth"), map);
      } else {
        check_steps(name, "depth", farthest, choice.depth_unit, "raise --depth-unit, or take --format npy");
        gart::write_depth_png(file("depth"), map, choice.depth_unit);
      }
      gart::write_png(preview("depth"), preview_of(map, nearest, farthest));
      entry["depth_nearest"] = nearest, entry["depth_farthest"] = farthest;
    }
    if (choice.has("normal")) {
      image_float normals = normals_of(map, view);
      if (npy) {
        gart::write_npy(file("normal"), normals);
      } else {
        for (std::size_t p = 0; p < normals.data.size(); p += 3) {
          float* const n = &normals.data[p];
          if (n[0] != 0 || n[1] != 0 || n[2] != 0)
            for (int c = 0; c < 3; ++c) n[c] = 0.5f + 0.5f * n[c];
        }
        gart::write_png(file("normal"), gart::to_8bit(normals));
      }
    }
  }
  if (choice.has("alpha")) {
    image_float alpha(image.transmittance.width, image.transmittance.height, 1);
    for (std::size_t p = 0; p < alpha.data.size(); ++p) alpha.data[p] = 1 - image.transmittance.data[p];
    npy ? gart::write_npy(file("alpha"), alpha) : gart::write_png(file("alpha"), gart::to_8bit(alpha));
  }
  if (choice.has("hits")) {
    image_float hits(image.hits.width, image.hits.height, 1);
    std::transform(image.hits.data.begin(), image.hits.data.end(), hits.data.begin(),
                   [](gart::u32 n) { return static_cast<float>(n); });
    auto const most = range_of(hits).second;
    if (npy) {
      gart::write_npy(file("hits"), hits);
    } else {
      check_steps(name, "number of hits", most, 1, "take --format npy");
      gart::write_depth_png(file("hits"), hits, 1);
    }
    gart::write_png(preview("hits"), preview_of(hits, 0, most));
    entry["most_hits"] = most;
  }
}

}  // namespace gart_cli
