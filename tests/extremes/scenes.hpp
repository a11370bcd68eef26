#pragma once
// Scenes at the edges of float: sizes, shapes, opacities, places, numbers of hits, cameras and images that renderers of
// Gaussians are known to fail at. Seeded; the same seed gives the same scenes with every compiler.

#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace gart_test {

// The tolerance of a scene that floats cannot decide at all.
inline constexpr double undecided = INFINITY;

struct extreme {
  oracle::scene scene;
  // Largest norm(error) / norm(gradient) of a group. Of well-conditioned scenes 1e-4, as in tests/render: roundings of
  // some tens of hits a ray, 2^-24 each, magnified up to 1 / (1 - 0.99). Others say why theirs is larger.
  double tolerance = 1e-4;
  // Least share of pixels that rounding leaves decided, so that the comparison cannot come to nothing.
  double decided = 0.9;
  // dL/d colour is random, from here to 1.
  double least = -1;
};

// Random numbers whose bits do not depend on the standard library.
class number_source {
 public:
  explicit number_source(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double log_uniform(double low, double high);
  double normal();

 private:
  std::mt19937_64 engine_;
};

struct shape {
  gart::vec3d mean, log_scale;
  double quaternion[4];  // w, x, y, z
  float logit;
};

// Appends one Gaussian of the model's degree, with random colours of which some are clamped.
void append(gart::gaussian_model& m, number_source& random, shape const& s);
// A random rotation of the given norm.
void rotate(shape& s, number_source& random, double norm = 1);
// The rotation that takes z to the unit vector `axis`, after a random one about z.
void turn_z_to(shape& s, gart::vec3d const& axis, number_source& random);

// A camera at the origin that looks along z; `focal` in pixels.
gart::camera looking_along_z(int width, int height, float focal);

// `count` ordinary Gaussians before that camera, in a ball of radius 1 at distance 3.
gart::gaussian_model cloud(number_source& random, int count, int sh_degree = 1);

std::vector<extreme> extremes(std::uint64_t seed);

}  // namespace gart_test
