#pragma once
// The reference that the library is tested against: brute force over all Gaussians for every pixel, in double, sharing
// no code with the library (its types are read as plain data). Cost: pixels x Gaussians, and one dual number a hit for
// gradients. Free of Eigen here, so that bodies compiled by nvcc may include it.
//
// For a ray o + t d, |d| = 1, and a Gaussian with M = S^-1 R^T:
//   o_g = M (o - mean), d_g = M d, t = -o_g.d_g / d_g.d_g, p = o_g + t d_g,
//   alpha = min(0.99, sigmoid(opacity) exp(-4.5 (|p| / 3)^n)), n the kernel degree, 2 for a Gaussian, a hit when alpha
//   >= alpha_min and t > near, colour = sum_i T_i alpha_i c_i + T background, T_(i+1) = T_i (1 - alpha_i), in the order
//   (t, id), until T < transmittance_min, or until max_hits hits where that is not 0.
//
// With options.antialias, f pixels, a Gaussian is widened before all that: r = f sqrt(w) |mean - o|, w the solid angle
// of a pixel towards its mean; s'^2 = s^2 + r^2; sigma' = sigma sqrt(prod s^2 e^T C^-1 e / (prod s'^2 e^T C'^-1 e)) for
// C = R S^2 R^T and e = mean - o.
//
// Every decision is also asked how far it is from going the other way in float: see pixel.

#include <gart/render/options.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace oracle {

// The parameters of gart::gaussian_model, same shapes, in double; also the shape of a gradient.
struct parameters {
  int sh_degree = 0;
  int kernel_degree = 2;
  std::vector<double> mean, log_scale, quaternion, opacity, sh;

  parameters() = default;
  explicit parameters(gart::gaussian_model const&);
  std::size_t size() const { return opacity.size(); }
};

// The slacks bound what float rounding of the ray, the scale and the rotation does to t and, relatively, to alpha.
struct hit {
  double t = 0, t_slack = 0;
  std::uint32_t id = 0;
  double alpha = 0, alpha_slack = 0;
  bool counted = true;    // false: just misses a threshold, and is listed because float may see a hit
  bool marginal = false;  // within rounding of alpha_min or near, on either side
  bool at_cusp = false;   // within rounding of the cusp of degree 1: alpha's gradient has no sure direction
  bool at_clamp = false;  // within rounding of 0.99, on either side: alpha's gradient may be zero or not
  unsigned clamps = 0;    // bits 0-2: colour channel held at 0; bit 3: alpha held at 0.99
};

struct pixel {
  double color[3] = {};
  double transmittance = 1, depth = 0;  // depth = sum of weight * t
  std::uint32_t hits = 0;
  std::vector<hit> list;  // in order, up to the end of the ray, with the marginal misses in between
  double rounding = 0;    // what float rounding, each undecided order and each undecided hit may do to a colour channel
  double transmittance_rounding = 0;  // what float rounding may do to the transmittance where no hit is undecided
  double slope_rounding = 0;  // what the undecided orders may do to the gradient of the pixel, relative to its norm
  bool edge = false;          // undecided: a hit, the end of the ray, or which hit that is
  bool kink = false;          // some alpha is within rounding of 0.99, or some colour of 0: the derivative may jump
};

// Whether two are of the same hits, clamped alike: between them the colour is smooth.
inline bool same_branches(pixel const& a, pixel const& b) {
  return std::equal(a.list.begin(), a.list.end(), b.list.begin(), b.list.end(), [](hit const& x, hit const& y) {
    return x.id == y.id && x.clamps == y.clamps && x.counted == y.counted;
  });
}

struct picture {
  int width = 0, height = 0;
  std::vector<pixel> pixels;  // row-major
};

// Of the camera from where it stands, in double: turned in the world about its position, by |turn| about `turn`, and
// shifted.
struct motion {
  double shift[3] = {}, turn[3] = {};
};

// `active_degree` <= the model's degree limits the bands evaluated.
picture render(parameters const&, gart::camera const&, gart::render_options const&, int active_degree,
               motion const& = {});

// Gradient of L given dL/dcolour [height][width][3] and, where not empty, dL/dtransmittance and dL/ddepth
// [height][width]. A clamp that holds has derivative zero.
parameters gradients(parameters const&, gart::camera const&, gart::render_options const&, int active_degree,
                     std::vector<double> const& color_gradient, std::vector<double> const& transmittance_gradient = {},
                     std::vector<double> const& depth_gradient = {});

// Unit direction, in the world, of the ray through the centre of pixel (i, j). Throws where the lens has no inverse.
struct direction {
  double x, y, z;
};
direction ray_through(gart::camera const&, int i, int j);

}  // namespace oracle
