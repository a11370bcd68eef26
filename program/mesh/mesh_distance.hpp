#pragma once
// How far a mesh is from the one that it should be. Both ways: from the mesh to the reference, and from the reference's
// parts that cameras see to the mesh. No mesh can have parts that no camera sees.

#include <gart/io/mesh_file.hpp>
#include <gart/scene/camera.hpp>

#include <vector>

namespace gart_cli {

struct mesh_score {
  double to_reference = 0, to_mesh = 0;  // mean distances, world units
  double mean = 0;                       // of both
  double precision = 0, recall = 0;      // parts that are within the threshold
  double f_score = 0;                    // their harmonic mean
};

mesh_score score_mesh(gart::triangle_mesh const& mesh, gart::triangle_mesh const& reference,
                      std::vector<gart::named_camera> const& cameras, double threshold);

}  // namespace gart_cli
