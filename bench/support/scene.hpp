#pragma once
// The Gaussians and the camera that every benchmark runs on: a splat PLY with a camera JSON, or discs. The discs are
// thin Gaussians of our own making, on three nested spheres. A ray has a few tens of hits, whatever their number.

#include <gart/comm/row_owners.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace gart_bench {

inline constexpr int sh_degree = 3;  // of what is timed stage by stage

struct scene {
  gart::gaussian_model model;
  std::vector<gart::named_camera> cameras;
  std::optional<gart::scene_file> among;  // meshes and lights
  gart::camera const& view() const { return cameras.front().view; }
};

struct scene_options {
  std::filesystem::path model, cameras;  // empty: discs
  std::filesystem::path scene;           // of meshes, lights and cameras, in place of a file of cameras
  std::size_t gaussians = 20000;
  int width = 320, height = 240;
  int copies = 1;          // of the discs, above each other: a camera sees one of them
  int degree = sh_degree;  // of the discs' colours, and what a model without a scene must have
};

scene make_scene(scene_options const& options);
// Of discs, with all cameras, the rows that one rank has of so many Gaussians as no host may hold. Gaussian g is of
// copy g % copies. So each view finds the same share of its rows on every rank.
scene make_part(scene_options const& options, gart::row_owners const& owners);
// STEM.ply and STEM.json.
void write_scene(std::filesystem::path const& stem, scene const& s);

// The scene of the run, made by main.
scene const& the_scene();

}  // namespace gart_bench
