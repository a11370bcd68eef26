#pragma once
// Fuses depth maps to a mesh. A sparse grid of OpenVDB holds a truncated signed distance, averaged in each voxel over
// its rays. That is Curless and Levoy, "A volumetric method for building complex models from range images", SIGGRAPH
// 1996. The mesh is its zero surface. Behind a surface, where others may see another, a ray counts the less the farther
// it goes. Space that no ray has passed has no surface.

#include "mesh_depth.hpp"

#include <gart/io/mesh_file.hpp>

#include <memory>
#include <vector>

namespace gart_cli {

struct fusion_options {
  double voxel = 0;          // world units
  double truncation = 4;     // voxels, on both sides of a surface
  std::size_t smallest = 0;  // connected parts of fewer triangles are left out
};

class fusion {
 public:
  // Errors: unsupported without OpenVDB, naming the package; invalid_argument for options out of range.
  explicit fusion(fusion_options const& options);
  ~fusion();
  void add(std::vector<met_ray> const& rays);
  gart::triangle_mesh mesh() const;

 private:
  struct grids;
  fusion_options options_;
  std::unique_ptr<grids> grids_;
};

}  // namespace gart_cli
