#include "commands.hpp"
#include "mesh_distance.hpp"
#include "mesh_fusion.hpp"
#include "options.hpp"
#include "output.hpp"
#include "printable.hpp"
#include "progress.hpp"

#include <gart/core/words.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/extent.hpp>
#include <gart/runtime/model_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct mesh_arguments {
  fs::path model, cameras, out, against, json;
  fusion_options fusion{.smallest = 100};
  int downscale = 1;
  double threshold = 0;
  bool quiet = false;
};

// As of captures.
double extent_of(std::vector<gart::named_camera> const& cameras) {
  std::vector<gart::vec3d> positions;
  for (auto const& c : cameras) positions.push_back(c.view.position);
  double const extent = gart::camera_extent(positions);
  return extent > 0 ? extent : 1;
}

// The width of a pixel where rays of the view meet the scene, in the middle of all.
double pixel_width(std::vector<met_ray> const& rays, gart::camera const& view) {
  std::vector<float> t;
  for (met_ray const& r : rays)
    if (r.t > 0) t.push_back(r.t);
  if (t.empty()) return 0;
  std::nth_element(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(t.size() / 2), t.end());
  gart::vec2 const pixels = gart::pixels_per_radian(view);
  double const distance = view.kind == gart::camera_kind::orthographic ? 1 : static_cast<double>(t[t.size() / 2]);
  return distance / static_cast<double>(std::min(pixels.x, pixels.y));
}

void print_score(mesh_score const& s, double extent, double threshold) {
  auto const part = [&](double distance) { return fixed(100 * distance / extent, 3) + " %"; };
  std::printf(
      "mean distance %.6g, %s of the extent %.6g: %s from the mesh to the reference, %s from what is seen of it\n",
      s.mean, part(s.mean).c_str(), extent, part(s.to_reference).c_str(), part(s.to_mesh).c_str());
  std::printf("F-score %s at %.6g: precision %s, recall %s\n", fixed(s.f_score, 4).c_str(), threshold,
              fixed(s.precision, 4).c_str(), fixed(s.recall, 4).c_str());
}

// What is wrong where no triangle is left.
std::string no_surface(double voxel, double pixel) {
  std::string const nothing = "there is no surface that the cameras see";
  if (!(pixel > 0) || (voxel > 0.5 * pixel && voxel < 2 * pixel))
    return nothing + " (give other cameras, or a smaller --least-part)";
  bool const large = voxel > pixel;
  char text[160];
  std::snprintf(text, sizeof text, ": voxels of %.4g are too %s where a pixel is %.4g wide (give %s, as --voxel %.2g)",
                voxel, large ? "large" : "small", pixel, large ? "smaller ones" : "larger ones", pixel);
  return nothing + text;
}

int run_mesh(mesh_arguments const& a) {
  if (gart::lower(a.out.extension().string()) != ".ply")
    throw usage_error("--out " + a.out.string() + ": gart mesh writes a PLY (give a name that ends in .ply)");
  gart::model_file file = gart::load_model(a.model);
  if (file.kernel_degree != 2)
    throw gart::unsupported(a.model.string() + ": is of kernel degree " + std::to_string(file.kernel_degree) +
                            "; gart mesh traces Gaussians (2)");
  auto const cameras = cameras_from(a.cameras, file.origin, a.downscale);
  prepare_file(a.out);
  if (!a.json.empty()) prepare_file(a.json);
  gart::triangle_mesh const reference =
      a.against.empty() ? gart::triangle_mesh() : gart::read_mesh_ply(a.against, file.origin);
  progress say(a.quiet);
  say.notes(file.notes);

  median_depths depths(std::move(file.model), file.render);
  fusion_options options = a.fusion;
  double const pixel = pixel_width(depths.of(cameras[0].view), cameras[0].view);
  if (options.voxel == 0) options.voxel = pixel;
  if (!(options.voxel > 0))
    throw gart::invalid_argument("the first camera sees no surface to take the size of voxels from (give --voxel)");
  // Rays so far apart share no voxel, and the voxels of each would fill the memory.
  if (options.voxel < 1e-3 * pixel) throw gart::invalid_argument(no_surface(options.voxel, pixel));
  fusion fused(options);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    fused.add(depths.of(cameras[i].view));
    say.state("fused " + std::to_string(i + 1) + "/" + std::to_string(cameras.size()) + " views",
              static_cast<double>(i + 1) / static_cast<double>(cameras.size()));
  }
  gart::triangle_mesh const mesh = fused.mesh();
  if (mesh.triangle.empty()) throw gart::invalid_argument(no_surface(options.voxel, pixel));
  gart::write_mesh_ply(a.out, mesh, file.origin);
  say.clear();
  if (!a.quiet)
    std::printf("%s: %s triangles from %zu views, voxels of %.4g\n", printable(a.out.string()).c_str(),
                with_commas(mesh.triangle.size()).c_str(), cameras.size(), options.voxel);
  nlohmann::json scores = {{"triangles", mesh.triangle.size()}, {"voxel", options.voxel}};
  if (!a.against.empty()) {
    double const extent = extent_of(cameras), threshold = a.threshold > 0 ? a.threshold : 0.005 * extent;
    mesh_score const s = score_mesh(mesh, reference, cameras, threshold);
    if (!a.quiet) print_score(s, extent, threshold);
    scores["mean_distance"] = s.mean, scores["to_reference"] = s.to_reference, scores["to_mesh"] = s.to_mesh;
    scores["extent"] = extent, scores["threshold"] = threshold;
    scores["precision"] = s.precision, scores["recall"] = s.recall, scores["f_score"] = s.f_score;
  }
  if (!a.json.empty()) write_json(a.json, scores);
  return 0;
}

}  // namespace

void add_mesh(CLI::App& app, command& selected) {
  auto a = std::make_shared<mesh_arguments>();
  CLI::App* mesh = app.add_subcommand("mesh", "Make a mesh of the surfaces that a model shows to the cameras.");
  add_model(*mesh, a->model)->required();
  add_open(*mesh, "CAMERAS", a->cameras, "", "A dataset (all its views), or a camera JSON, as for gart render")
      ->required();
  add_open(*mesh, "--out", a->out, "MESH.ply", "The mesh to write, a PLY of triangles")->required();
  add_open(*mesh, "--voxel", a->fusion.voxel, "U",
           "Side of a voxel, in the capture's units (default: a pixel's width\nwhere the first camera meets the "
           "scene)")
      ->check(between(1e-9, 1e9));
  add_value(*mesh, "--truncation", a->fusion.truncation, "N", "Voxels on both sides of a surface that a ray tells of")
      ->check(between(1, 64));
  add_value(*mesh, "--least-part", a->fusion.smallest, "N", "Leave out parts of fewer triangles that hang together")
      ->check(whole_number());
  add_downscale(*mesh, a->downscale);
  add_open(*mesh, "--against", a->against, "REFERENCE.ply",
           "Measure its distance to this mesh, both ways, where the cameras\nsee it; gart synth "
           "--mesh writes the mesh of its scene");
  add_open(*mesh, "--threshold", a->threshold, "U",
           "Distance within which the F-score takes a point for right\n(default: 0.005 of the extent of the "
           "cameras)")
      ->check(between(1e-12, 1e12));
  add_open(*mesh, "--json", a->json, "FILE", "Write these scores");
  add_quiet(*mesh, a->quiet);
  mesh->footer(
      "\nA ray meets the scene at its median hit: behind it less than half of the light is left.\n"
      "Distances are averaged a voxel, and the mesh is where they are zero. Runs on the CPU; needs OpenVDB.\n"
      "\nExamples:\n"
      "  gart mesh run/model.ply capture --out mesh.ply\n"
      "  gart synth --out still --mesh\n"
      "  gart mesh run/model.ply still --out mesh.ply --against still/mesh.ply");
  mesh->callback([a, &selected] { selected = [a] { return run_mesh(*a); }; });
}

}  // namespace gart_cli
