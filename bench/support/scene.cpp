#include "support/scene.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

#include <algorithm>
#include <cmath>
#include <random>

namespace gart_bench {

namespace {

gart::gaussian_model discs(std::size_t n, int degree) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  constexpr float radii[] = {0.5f, 0.75f, 1.0f};
  std::discrete_distribution<int> sphere({0.25, 0.5625, 1.0});  // by area
  float const area = 4 * 3.14159265f * (0.25f + 0.5625f + 1.0f);
  float const spacing = std::sqrt(area / static_cast<float>(n));

  gart::gaussian_model model;
  model.resize(n, degree);
  for (std::size_t i = 0; i < n; ++i) {
    float const r = radii[sphere(random)];
    float d[3] = {normal(random), normal(random), normal(random)};
    float const length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) + 1e-12f;
    for (float& x : d) x /= length;
    for (int k = 0; k < 3; ++k) model.mean[3 * i + k] = r * d[k];
    float const size = std::log(0.5f * spacing) + 0.4f * normal(random);
    model.log_scale[3 * i] = size + 0.3f * normal(random);
    model.log_scale[3 * i + 1] = size;
    model.log_scale[3 * i + 2] = size - 1.5f;
    // The rotation that takes z to d, which lays the disc on its sphere.
    float const q[4] = {1 + d[2], -d[1], d[0], 0};
    bool const opposite = q[0] < 1e-4f;
    for (int k = 0; k < 4; ++k) model.quaternion[4 * i + k] = opposite ? (k == 1) : q[k];
    model.opacity[i] = -3 + 6 * uniform(random);
    float* sh = model.sh.data() + 3 * gart::sh_coefficients(degree) * i;
    for (int k = 0; k < 3 * gart::sh_coefficients(degree); ++k) sh[k] = (k < 3 ? 0.8f : 0.05f) * normal(random);
  }
  return model;
}

std::vector<gart::named_camera> orbit(int count, int width, int height) {
  std::vector<gart::named_camera> out;
  for (int i = 0; i < count; ++i) {
    double const angle = 2 * 3.14159265358979 * i / count, c = std::cos(angle), s = std::sin(angle);
    gart::camera view;
    view.width = width, view.height = height;
    view.fx = view.fy = 1.2f * static_cast<float>(height);
    view.cx = 0.5f * static_cast<float>(width), view.cy = 0.5f * static_cast<float>(height);
    view.position = gart::vec3d(2.2 * c, 2.2 * s, 0);
    // Columns: right, down, forward, towards the centre with the world's z up.
    view.rotation[0] = gart::vec3(static_cast<float>(-s), static_cast<float>(c), 0);
    view.rotation[1] = gart::vec3(0, 0, -1);
    view.rotation[2] = gart::vec3(static_cast<float>(-c), static_cast<float>(-s), 0);
    out.push_back({"orbit_" + std::to_string(i), view});
  }
  return out;
}

}  // namespace

scene make_part(scene_options const& options, gart::row_owners const& owners) {
  // A sphere has radius 1, and a camera 2.2 from its centre sees no further up or down than 1.4.
  constexpr float apart = 4;
  auto const copies = static_cast<std::size_t>(options.copies);
  gart::gaussian_model const one = discs((options.gaussians + copies - 1) / copies, options.degree);
  scene s;
  s.model.resize(owners.owned(options.gaussians), options.degree);
  owners.for_each_run(options.gaussians, [&](gart::u64 first, gart::u64 count, gart::u64 row) {
    for (gart::u64 k = 0; k < count; ++k) {
      std::size_t const from = (first + k) / copies, to = row + k;
      gart::for_each_array(
          [&](gart::parameter_array const& array, auto const& source, auto& target) {
            std::size_t const width = array.width(options.degree);
            std::copy_n(source.data() + width * from, width, target.data() + width * to);
          },
          one, s.model);
      s.model.mean[3 * to + 2] += apart * static_cast<float>((first + k) % copies);
    }
  });
  s.cameras = orbit(8, options.width, options.height);
  for (std::size_t i = 0; i < s.cameras.size(); ++i)
    s.cameras[i].view.position.z += static_cast<double>(apart) * static_cast<double>(i * copies / s.cameras.size());
  return s;
}

scene make_scene(scene_options const& options) {
  scene s;
  if (options.model.empty()) {
    s.model = discs(options.gaussians, options.degree);
    s.cameras = orbit(8, options.width, options.height);
    return s;
  }
  s.model = gart::read_splat_ply(options.model);
  if (options.scene.empty()) {
    s.cameras = gart::load_cameras(options.cameras);
  } else {
    s.among = gart::read_scene(options.scene);
    s.cameras = s.among->cameras;
    for (auto& [name, view] : s.cameras) view = gart::resized(view, options.width, options.height);
  }
  if (options.scene.empty() && s.model.sh_degree != options.degree)
    throw gart::io_error(options.model.string(), "has SH degree " + std::to_string(s.model.sh_degree),
                         "name a model of degree " + std::to_string(options.degree));
  if (s.cameras.empty())
    throw gart::io_error((options.scene.empty() ? options.cameras : options.scene).string(), "has no cameras",
                         "name a dataset or a camera JSON");
  return s;
}

void write_scene(std::filesystem::path const& stem, scene const& s) {
  gart::write_splat_ply(stem.string() + ".ply", s.model);
  std::string text = "[";
  for (auto const& [name, view] : s.cameras) {
    auto const field = [&](char const* key, double value) {
      text += std::string(", \"") + key + "\": " + std::to_string(value);
    };
    text += (text.size() > 1 ? ",\n" : "") + std::string("{\"name\": \"") + name +
            "\", \"width\": " + std::to_string(view.width) + ", \"height\": " + std::to_string(view.height);
    field("fx", view.fx), field("fy", view.fy), field("cx", view.cx), field("cy", view.cy);
    text += ", \"c2w\": [";
    for (int row = 0; row < 3; ++row) {
      text += "[";
      for (int column = 0; column < 3; ++column) text += std::to_string(view.rotation[column][row]) + ", ";
      text += std::to_string(view.position[row]) + "], ";
    }
    text += "[0, 0, 0, 1]]}";
  }
  gart::write_file(stem.string() + ".json", text + "]\n");
}

}  // namespace gart_bench
