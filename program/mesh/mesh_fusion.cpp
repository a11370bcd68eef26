#include "mesh_fusion.hpp"

#include "mesh_parts.hpp"

#include <gart/core/error.hpp>

#if defined(GART_WITH_OPENVDB)
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#endif

#include <algorithm>
#include <cmath>

namespace gart_cli {

#if defined(GART_WITH_OPENVDB)

namespace {

constexpr float least_weight = 2;  // rays that a voxel must have been passed by

openvdb::Coord below(gart::vec3d const& p) {
  return {static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)), static_cast<int>(std::floor(p.z))};
}

}  // namespace

struct fusion::grids {
  openvdb::FloatGrid::Ptr distance = openvdb::FloatGrid::create(1.0f),  // in truncations
      weight = openvdb::FloatGrid::create(0.0f);
};

fusion::fusion(fusion_options const& options) : options_(options) {
  if (!(options.voxel > 0 && options.truncation >= 1))
    throw gart::invalid_argument("a mesh needs voxels above 0, and a truncation of one of them or more");
  openvdb::initialize();
  grids_ = std::make_unique<grids>();
}

void fusion::add(std::vector<met_ray> const& rays) {
  auto distance = grids_->distance->getAccessor(), weight = grids_->weight->getAccessor();
  double const voxel = options_.voxel, reach = options_.truncation * voxel;
  for (met_ray const& r : rays) {
    if (!(r.t > 0)) continue;
    gart::vec3d const along(r.direction);
    // Half a voxel a step, so that none is passed over; each once.
    openvdb::Coord last = openvdb::Coord::max();
    for (double s = -reach; s <= reach; s += 0.5 * voxel) {
      openvdb::Coord const at = below((r.origin + (r.t + s) * along) / voxel + gart::vec3d(0.5));
      if (at == last) continue;
      last = at;
      gart::vec3d const center = voxel * gart::vec3d(at.x(), at.y(), at.z());
      double const signed_distance = r.t - glm::dot(center - r.origin, along);
      if (std::abs(signed_distance) > reach) continue;
      float const mine = static_cast<float>(std::min(1.0, (signed_distance + reach) / (reach - voxel / 2)));
      float const before = weight.getValue(at), sum = before + mine;
      if (!(mine > 0)) continue;
      distance.setValue(at,
                        (before * distance.getValue(at) + mine * static_cast<float>(signed_distance / reach)) / sum);
      weight.setValue(at, sum);
    }
  }
}

gart::triangle_mesh fusion::mesh() const {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grids_->distance, points, quads, 0.0);
  // A zero between seen and unseen space is no surface.
  auto const weight = grids_->weight->getConstAccessor();
  auto const seen = [&](openvdb::Vec3s const& p) {
    openvdb::Coord const at = below({p.x(), p.y(), p.z()});
    bool all = true;
    for (int c = 0; c < 8; ++c) all = all && weight.getValue(at.offsetBy(c & 1, c >> 1 & 1, c >> 2)) >= least_weight;
    return all;
  };
  std::vector<char> keep(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) keep[i] = seen(points[i]);
  gart::triangle_mesh out;
  for (openvdb::Vec3s const& p : points)
    out.position.push_back(static_cast<float>(options_.voxel) * gart::vec3(p.x(), p.y(), p.z()));
  for (openvdb::Vec4I const& q : quads) {
    if (!keep[q[0]] || !keep[q[1]] || !keep[q[2]] || !keep[q[3]]) continue;
    out.triangle.push_back({q[0], q[1], q[2]});
    out.triangle.push_back({q[0], q[2], q[3]});
  }
  return large_parts(out, options_.smallest);
}

#else

struct fusion::grids {};
fusion::fusion(fusion_options const&) {
  throw gart::unsupported(
      "this gart was built without OpenVDB, which makes meshes (install libopenvdb-dev and libboost-dev on Debian and "
      "Ubuntu, and build with -DGART_OPENVDB=ON)");
}
void fusion::add(std::vector<met_ray> const&) {}
gart::triangle_mesh fusion::mesh() const { return {}; }

#endif

fusion::~fusion() = default;

}  // namespace gart_cli
