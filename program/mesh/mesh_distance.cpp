#include "mesh_distance.hpp"

#include "mesh_parts.hpp"

#include <gart/bvh/bvh.hpp>
#include <gart/bvh/walk.hpp>
#include <gart/camera/models.hpp>
#include <gart/exec/openmp.hpp>
#include <gart/exec/parallel.hpp>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace gart_cli {

namespace {

using gart::u32;
using gart::u64;
using gart::vec3;

constexpr std::size_t samples = 100'000;

struct corners {
  vec3 a, b, c;
};
std::vector<corners> corners_of(gart::triangle_mesh const& mesh) {
  std::vector<corners> all;
  for (auto const& t : mesh.triangle) all.push_back({mesh.position[t[0]], mesh.position[t[1]], mesh.position[t[2]]});
  return all;
}

// The square of the distance to a triangle (Ericson, "Real-Time Collision Detection", 5.1.5).
float distance2(vec3 const& p, corners const& t) {
  auto const square = [](vec3 const& v) { return glm::dot(v, v); };
  vec3 const ab = t.b - t.a, ac = t.c - t.a, ap = p - t.a;
  float const d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return square(ap);
  vec3 const bp = p - t.b;
  float const d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return square(bp);
  vec3 const cp = p - t.c;
  float const d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return square(cp);
  float const vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return square(ap - ab * (d1 / (d1 - d3)));
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return square(ap - ac * (d2 / (d2 - d6)));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    float const w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return square(bp - (t.c - t.b) * w);
  }
  float const whole = va + vb + vc;
  if (!(whole != 0)) return square(ap);
  return square(ap - ab * (vb / whole) - ac * (vc / whole));
}

// Triangles by the cells of a grid that they reach into.
class nearest_triangle {
 public:
  explicit nearest_triangle(gart::triangle_mesh const& mesh) : triangles_(corners_of(mesh)) {
    vec3 lo(3e38f), hi(-3e38f);
    for (vec3 const& p : mesh.position) lo = glm::min(lo, p), hi = glm::max(hi, p);
    vec3 const size = hi - lo;
    cell_ = std::max(std::max(size.x, size.y), size.z) / 128;
    if (!(cell_ > 0)) cell_ = 1;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      corners const& t = triangles_[i];
      auto const from = place(glm::min(t.a, glm::min(t.b, t.c))), to = place(glm::max(t.a, glm::max(t.b, t.c)));
      for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
          for (int z = from[2]; z <= to[2]; ++z) cells_[key(x, y, z)].push_back(static_cast<u32>(i));
    }
  }

  // Shell by shell of cells, until none can be nearer; no farther than `most`.
  float distance(vec3 const& p, float most) const {
    auto const at = place(p);
    float best = most * most;
    for (int shell = 0; static_cast<float>(shell - 1) * cell_ < most; ++shell) {
      if (shell > 0 && static_cast<float>(shell - 1) * cell_ > std::sqrt(best)) break;
      for (int x = -shell; x <= shell; ++x)
        for (int y = -shell; y <= shell; ++y) {
          bool const edge = std::abs(x) == shell || std::abs(y) == shell;
          for (int z = -shell; z <= shell; z += edge || shell == 0 ? 1 : 2 * shell) {
            auto const found = cells_.find(key(at[0] + x, at[1] + y, at[2] + z));
            if (found == cells_.end()) continue;
            for (u32 const i : found->second) best = std::min(best, distance2(p, triangles_[i]));
          }
        }
    }
    return std::sqrt(best);
  }

 private:
  std::array<int, 3> place(vec3 const& p) const {
    std::array<int, 3> at;
    for (int k = 0; k < 3; ++k) at[static_cast<std::size_t>(k)] = static_cast<int>(std::floor(p[k] / cell_));
    return at;
  }
  static u64 key(int x, int y, int z) {
    auto const bits = [](int v) { return static_cast<u64>(v + (1 << 20)) & 0x1fffff; };
    return bits(x) << 42 | bits(y) << 21 | bits(z);
  }

  std::vector<corners> triangles_;
  std::unordered_map<u64, std::vector<u32>> cells_;
  float cell_ = 1;
};

// Seeks the nearest triangle that a ray meets (Moeller and Trumbore).
struct first_triangle {
  corners const* triangles;
  gart::ray ray;
  float nearest = gart::infinity;
  float near() const { return 0; }
  float far() const { return nearest; }
  void leaf(u32 i) {
    corners const& t = triangles[i];
    vec3 const e = t.b - t.a, f = t.c - t.a, p = glm::cross(ray.direction, f);
    float const det = glm::dot(e, p);
    if (det == 0) return;
    vec3 const s = ray.origin - t.a, q = glm::cross(s, e);
    float const u = glm::dot(s, p) / det, v = glm::dot(ray.direction, q) / det, at = glm::dot(f, q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && at > 0) nearest = std::min(nearest, at);
  }
};

// Where rays of the cameras, about as many as there are samples, first meet the mesh.
std::vector<vec3> seen_points(gart::triangle_mesh const& mesh, std::vector<gart::named_camera> const& cameras) {
  std::vector<corners> const triangles = corners_of(mesh);
  gart::openmp_exec exec;
  std::vector<gart::box> boxes;
  for (corners const& t : triangles)
    boxes.push_back({glm::min(t.a, glm::min(t.b, t.c)), glm::max(t.a, glm::max(t.b, t.c))});
  gart::buffer<gart::box, gart::openmp_exec> scene(exec, boxes);
  gart::bvh<gart::openmp_exec> tree(exec);
  tree.build(exec, std::as_const(scene).view());
  double pixels = 0;
  for (auto const& [name, view] : cameras) pixels += double{1.0} * view.width * view.height;
  int const step = std::max(1, static_cast<int>(std::sqrt(pixels / samples)));
  std::vector<vec3> points;
  for (auto const& [name, view] : cameras)
    for (int y = step / 2; y < view.height; y += step)
      for (int x = step / 2; x < view.width; x += step) {
        gart::ray r = ray_through(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        r.origin = vec3(view.position + gart::vec3d(r.origin));
        first_triangle seek{triangles.data(), r};
        gart::walk(tree.view(), r, seek);
        if (seek.nearest < gart::infinity) points.push_back(r.origin + seek.nearest * r.direction);
      }
  return points;
}

// Mean distance, and the part that is within the threshold.
std::pair<double, double> to_mesh(std::vector<vec3> const& points, gart::triangle_mesh const& mesh, double threshold) {
  nearest_triangle const nearest(mesh);
  // Farther distances count as this one: one lost point must not spoil a mean.
  float const most = static_cast<float>(20 * threshold);
  double sum = 0, within = 0;
#pragma omp parallel for schedule(dynamic, 256) reduction(+ : sum, within)
  for (std::size_t i = 0; i < points.size(); ++i) {
    double const d = static_cast<double>(nearest.distance(points[i], most));
    sum += d, within += d <= threshold;
  }
  double const n = std::max<double>(1, static_cast<double>(points.size()));
  return {sum / n, within / n};
}

}  // namespace

mesh_score score_mesh(gart::triangle_mesh const& mesh, gart::triangle_mesh const& reference,
                      std::vector<gart::named_camera> const& cameras, double threshold) {
  mesh_score s;
  std::tie(s.to_reference, s.precision) = to_mesh(even_samples(mesh, samples), reference, threshold);
  std::tie(s.to_mesh, s.recall) = to_mesh(seen_points(reference, cameras), mesh, threshold);
  s.mean = 0.5 * (s.to_reference + s.to_mesh);
  double const both = s.precision + s.recall;
  s.f_score = both > 0 ? 2 * s.precision * s.recall / both : 0;
  return s;
}

}  // namespace gart_cli
