#include "render_images.hpp"

#include "commands.hpp"

#include <gart/core/words.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/io/exr_file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/image_modes.hpp>

#include <algorithm>
#include <cstdio>
#include <sstream>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;
using gart::image_float;

std::vector<std::string> parts_of(std::string const& list) {
  std::vector<std::string> parts;
  std::istringstream text(list);
  for (std::string one; std::getline(text, one, ',');) parts.push_back(one);
  return parts;
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
  static std::vector<std::string> const all{"colour", "depth", "normal", "alpha", "hits", "albedo", "surface", "ids"};
  return all;
}

bool image_choice::has(std::string const& name) const {
  auto const chosen = parts_of(images);
  return std::find(chosen.begin(), chosen.end(), name) != chosen.end();
}

void check_images(image_choice const& choice) {
  auto const& names = image_choice::names();
  auto const chosen = parts_of(choice.images);
  std::string const all = gart::joined(names);
  if (chosen.empty()) throw usage_error("--images: name one of " + all);
  for (std::string const& one : chosen)
    if (std::find(names.begin(), names.end(), one) == names.end())
      throw usage_error("--images " + one + ": there is no such image; there are " + all);
}

void write_layers(fs::path const& folder, std::string const& name, gart::path_layers const& layers,
                  image_choice const& choice) {
  auto const write = [&](std::string const& what, image_float const& values, char const* channels, bool exact) {
    fs::path const file = folder / (name + "_" + what);
    if (choice.format == "npy")
      gart::write_npy(file.string() + ".npy", values);
    else if (choice.format == "exr" || exact)
      gart::write_exr(file.string() + ".exr", values, channels);
    else
      gart::write_png(file.string() + ".png", gart::to_8bit(values));
  };
  if (choice.has("albedo")) write("albedo", layers.albedo, "RGB", false);
  if (choice.has("surface")) {
    image_float normal = layers.normal;
    if (choice.format == "png")
      for (float& v : normal.data) v = 0.5f * (v + 1);
    write("surface", normal, "XYZ", false);
  }
  if (choice.has("ids")) {
    image_float ids(layers.mesh.width, layers.mesh.height, 3, -1.0f);
    for (std::size_t i = 0; i < layers.mesh.data.size(); ++i) {
      std::size_t c = 0;
      for (auto const* of : {&layers.gaussian, &layers.mesh, &layers.triangle}) {
        gart::u32 const number = of->data[i];
        if (number != gart::no_number) ids.data[3 * i + c] = static_cast<float>(number);
        ++c;
      }
    }
    write("ids", ids, "GMT", true);
  }
}

void write_images(fs::path const& folder, std::string const& name, gart::rendered const& image,
                  gart::camera const& view, image_choice const& choice, nlohmann::json& entry) {
  bool const exr = choice.format == "exr", floats = exr || choice.format == "npy";
  // As they are, by letters of EXR's channels.
  auto const write_floats = [&](std::string const& what, image_float const& values, char const* channels) {
    fs::path const file = folder / (name + what + "." + choice.format);
    exr ? gart::write_exr(file, values, channels) : gart::write_npy(file, values);
  };
  auto const file = [&](char const* what) { return folder / (name + "_" + what + ".png"); };
  auto const preview = [&](char const* what) { return folder / (name + "_" + what + "_preview.png"); };
  if (exr && choice.has("colour")) write_floats("", image.color, "RGB");
  if (choice.has("depth") || choice.has("normal")) {
    image_float const map = gart::mean_distances(image);
    if (choice.has("depth")) {
      auto const [nearest, farthest] = gart::range_of(map);
      if (floats) {
        write_floats("_depth", map, "Z");
      } else {
        check_steps(name, "depth", farthest, choice.depth_unit, "raise --depth-unit, or take --format exr");
        gart::write_depth_png(file("depth"), map, choice.depth_unit);
      }
      gart::write_png(preview("depth"), gart::in_colors(map, nearest, farthest));
      entry["depth_nearest"] = nearest, entry["depth_farthest"] = farthest;
    }
    if (choice.has("normal")) {
      image_float const normals = gart::normals_of(map, view);
      floats ? write_floats("_normal", normals, "XYZ")
             : gart::write_png(file("normal"), gart::to_8bit(gart::normal_colors(normals)));
    }
  }
  if (choice.has("alpha")) {
    image_float const alpha = gart::alpha_of(image);
    floats ? write_floats("_alpha", alpha, "A") : gart::write_png(file("alpha"), gart::to_8bit(alpha));
  }
  if (choice.has("hits")) {
    image_float const hits = gart::hits_of(image);
    auto const most = gart::range_of(hits).second;
    if (floats) {
      write_floats("_hits", hits, "Y");
    } else {
      check_steps(name, "number of hits", most, 1, "take --format exr");
      gart::write_depth_png(file("hits"), hits, 1);
    }
    gart::write_png(preview("hits"), gart::in_colors(hits, 0, most));
    entry["most_hits"] = most;
  }
}

}  // namespace gart_cli
