#include "synth_capture.hpp"

#include "synth_random.hpp"
#include "synth_trace.hpp"

#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/mesh_file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/ply.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <system_error>

namespace gart_cli {
namespace {

namespace fs = std::filesystem;

constexpr double angle_x = 0.69;     // horizontal field of view, radians: NeRF-Synthetic's
constexpr double distance = 3.7;     // the scene's bounding sphere just fits the view
constexpr double depth_step = 1e-4;  // of the maps: 65535 of them reach past the scene
constexpr char mark[] = "\"generator\": \"gart synth\"";

void check_range(char const* option, int value, synth_limits limits) {
  if (value < limits.low || value > limits.high)
    throw gart::invalid_argument(std::string(option) + " " + std::to_string(value) + ": give " +
                                 std::to_string(limits.low) + " to " + std::to_string(limits.high));
}

// A folder of somebody else's is never written into: a real capture has files of the same names.
void prepare_folder(fs::path const& out) {
  std::error_code failed;
  if (fs::exists(out, failed) && !fs::is_directory(out, failed))
    throw gart::io_error(out.string(), "is not a folder", "give --out another name");
  if (fs::is_directory(out, failed) && !fs::is_empty(out, failed)) {
    fs::path const transforms = out / "transforms_train.json";
    std::string text;
    if (fs::exists(transforms, failed)) {
      auto const bytes = gart::read_file(transforms);
      text.assign(bytes.begin(), bytes.end());
    }
    if (text.find(mark) == std::string::npos && !fs::exists(out / ".gart-synth", failed))
      throw gart::io_error(out.string(), "holds files that gart synth did not write",
                           "give --out a new or empty folder");
  }
  fs::create_directories(out / "train", failed);
  if (!failed) fs::create_directories(out / "test", failed);
  if (failed)
    throw gart::io_error(out.string(), "cannot be made: " + failed.message(),
                         "give --out a folder that can be written");
  // Marks the folder as gart's own until the transforms do, so that an interrupted run can be repeated.
  gart::write_file(out / ".gart-synth", std::string_view("an unfinished capture of gart synth\n"));
  for (char const* split : {"train", "test"}) fs::remove(out / (std::string("transforms_") + split + ".json"), failed);
}

// Turns about one of its own axes, row by row. It travels as far as half that angle is at the scene.
gart::camera while_moving(gart::camera const& view, double degrees, u64 seed) {
  auto const random = [&](u64 k) { return unit_float(static_cast<u32>(hash(seed, k))); };
  double const angle = degrees * std::numbers::pi / 180, about = 2 * std::numbers::pi * random(0),
               towards = 2 * std::numbers::pi * random(1);
  gart::vec3d const turn(angle * std::cos(about), angle * std::sin(about), 0);
  double const far = 0.5 * angle * distance;
  gart::vec3d const travel(far * std::cos(towards), far * std::sin(towards), 0);
  gart::camera out = view;
  out.shutter = gart::shutter_kind::top_to_bottom;
  out.turn = vec3(turn), out.travel = vec3(travel);
  return out;
}

std::string pose_text(gart::camera const& view) {
  char text[256];
  std::string out = "[";
  for (int row = 0; row < 3; ++row) {
    gart::mat3 const& r = view.rotation;
    // OpenGL's y and z are the negatives of OpenCV's.
    std::snprintf(text, sizeof text, "[%.9g, %.9g, %.9g, %.17g], ", r[0][row], -r[1][row], -r[2][row],
                  view.position[row]);
    out += text;
  }
  return out + "[0, 0, 0, 1]]";
}

std::string transforms_json(std::vector<gart::camera> cameras, std::string const& split, bool depth,
                            gart::vec3d const& origin) {
  char text[256];
  for (gart::camera& c : cameras) c.position += origin;
  gart::camera const& first = cameras.front();
  std::string json = std::string("{\n  ") + mark + ",\n";
  bool const rolls = first.shutter != gart::shutter_kind::global;
  if (auto const lens = gart::fields_of(first); lens.model == "PINHOLE" && !rolls) {
    std::snprintf(text, sizeof text, "  \"camera_angle_x\": %.17g,\n", angle_x);
    json += text;
  } else {
    json += "  \"camera_model\": \"" + lens.model + "\",\n  \"w\": " + std::to_string(first.width) +
            ",\n  \"h\": " + std::to_string(first.height) + ",\n";
    for (auto const& [name, value] : lens.values) {
      bool const focal = name == "fx" || name == "fy";
      std::snprintf(text, sizeof text, "  \"%s\": %.9g,\n", focal ? name == "fx" ? "fl_x" : "fl_y" : name.c_str(),
                    value);
      json += text;
    }
  }
  if (rolls) json += "  \"shutter_type\": \"" + gart::shutter_type_of(first) + "\",\n";
  if (depth) {
    std::snprintf(text, sizeof text, "  \"depth_kind\": \"distance\",\n  \"depth_unit_scale_factor\": %g,\n",
                  depth_step);
    json += text;
  }
  json += "  \"frames\": [";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    json += i == 0 ? "\n" : ",\n";
    std::string const file = "./" + split + "/r_" + std::to_string(i);
    json += "    {\"file_path\": \"" + file + "\", ";
    if (depth) json += "\"depth_file_path\": \"" + file + "_depth.png\", ";
    if (rolls) {
      gart::line_poses const lines = gart::poses_of_lines(cameras[i]);
      json +=
          "\"transform_matrix\": " + pose_text(lines.first) + ", \"transform_matrix_end\": " + pose_text(lines.last);
    } else {
      json += "\"transform_matrix\": " + pose_text(cameras[i]);
    }
    json += "}";
  }
  return json + "\n  ]\n}\n";
}

gart::triangle_mesh mesh_of(synth_scene const& scene) {
  gart::triangle_mesh all;
  for (synth_mesh const& part : scene) {
    u32 const before = static_cast<u32>(all.position.size());
    all.position.insert(all.position.end(), part.position.begin(), part.position.end());
    for (std::size_t i = 0; i + 2 < part.index.size(); i += 3)
      all.triangle.push_back({before + part.index[i], before + part.index[i + 1], before + part.index[i + 2]});
  }
  return all;
}

// A ray that misses all is as white in the mirror as the photographs' background.
std::string scene_with(synth_mirror mirror, gart::vec3d const& origin) {
  std::string mesh = R"("file": "mirror.ply")";
  if (mirror == synth_mirror::ball) {
    gart::vec3d const at = gart::vec3d(ball_center) + origin;
    char text[160];
    std::snprintf(text, sizeof text, R"("shape": "sphere", "scale": %.9g, "translation": [%.17g, %.17g, %.17g])",
                  double{ball_radius}, at.x, at.y, at.z);
    mesh = text;
  }
  return R"({
  "up": [0, 0, 1],
  "background": [1, 1, 1],
  "environment": {"color": [1, 1, 1]},
  "materials": [{"name": "mirror", "kind": "mirror"}],
  "meshes": [{)" +
         mesh + R"(, "material": "mirror"}]
}
)";
}

}  // namespace

std::vector<gart::camera> synth_cameras(int count, int size, bool test) {
  double const golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<gart::camera> cameras;
  for (int i = 0; i < count; ++i) {
    // Height is uniform, hence so is the density on the sphere. Half a turn sets the test views between the others.
    double const lowest = test ? 0.16 : 0.08, highest = test ? 0.88 : 0.95;
    double const z = lowest + (highest - lowest) * (i + 0.5) / count, azimuth = golden * i + (test ? -0.9 : 0.0);
    double const r = std::sqrt(1 - z * z);
    gart::vec3d const outward(r * std::cos(azimuth), r * std::sin(azimuth), z);
    gart::vec3d const right(-std::sin(azimuth), std::cos(azimuth), 0), down = glm::cross(-outward, right);
    gart::camera c;
    c.width = c.height = size;
    c.fx = c.fy = static_cast<float>(0.5 * size / std::tan(0.5 * angle_x));
    c.cx = c.cy = 0.5f * static_cast<float>(size);
    c.rotation = gart::mat3(vec3(right), vec3(down), vec3(-outward));
    c.position = distance * outward;
    cameras.push_back(c);
  }
  return cameras;
}

void write_synth_capture(synth_options const& options, std::function<void(int done, int total)> const& progress) {
  static_assert(synth_samples.high <= static_cast<int>(sample_sequence::max_samples));
  check_range("--train", options.train, synth_views);
  check_range("--test", options.test, synth_views);
  check_range("--size", options.size, synth_size);
  check_range("--samples", options.samples, synth_samples);
  check_range("--points", options.points, synth_points);
  check_range("--threads", options.threads, synth_threads);
  if (!(options.rolling >= 0 && options.rolling <= synth_rolling_most))
    throw gart::invalid_argument("--rolling: give 0 to 90 degrees");

  gart::vec3d origin(0.0);
  if (!options.origin.empty()) origin = gart::origin_of({{"origin", options.origin}}, "--origin");
  auto train = synth_cameras(options.train, options.size, false);
  auto test = synth_cameras(options.test, options.size, true);
  for (auto* cameras : {&train, &test})
    for (gart::camera& c : *cameras)
      if (!options.camera.empty()) c = gart::seen_through(c, options.camera);
  if (options.rolling > 0)
    for (std::size_t i = 0; i < train.size(); ++i) {
      train[i] = while_moving(train[i], options.rolling, hash(options.seed, 0x726f6c6c + i));
      gart::require_camera(train[i]);
    }
  synth_scene const scene = make_synth_scene(options.seed, options.mirror);
  synth_renderer const renderer(scene, options.threads);
  prepare_folder(options.out);
  int done = 0;
  int const total = options.train + options.test;
  for (auto const* cameras : {&train, &test}) {
    fs::path const folder = options.out / (cameras == &train ? "train" : "test");
    for (std::size_t i = 0; i < cameras->size(); ++i) {
      auto const image = renderer.render((*cameras)[i], options.samples, hash(options.seed, done));
      std::string const name = "r_" + std::to_string(i);
      gart::write_png(folder / (name + ".png"), image);
      if (options.depth)
        gart::write_depth_png(folder / (name + "_depth.png"), renderer.distances((*cameras)[i]), depth_step);
      ++done;
      if (progress) progress(done, total);
    }
  }
  gart::write_point_ply(options.out / "points3d.ply", renderer.points(train, options.points, options.seed), origin);
  if (options.mesh) gart::write_mesh_ply(options.out / "mesh.ply", mesh_of(scene), origin);
  if (options.mirror == synth_mirror::plane)
    gart::write_mesh_ply(options.out / "mirror.ply", mesh_of({scene.back()}), origin);
  if (options.mirror != synth_mirror::none)
    gart::write_file(options.out / "scene.json", std::string_view(scene_with(options.mirror, origin)));
  gart::write_file(options.out / "transforms_test.json", transforms_json(test, "test", options.depth, origin));
  gart::write_file(options.out / "transforms_train.json", transforms_json(train, "train", options.depth, origin));
  std::error_code ignored;
  fs::remove(options.out / ".gart-synth", ignored);
}

}  // namespace gart_cli
