#pragma once
/// \file
/// The reference of the renderer: the definition of an image and of its gradients, in double. One test alone makes it
/// faster: it leaves out Gaussians that cannot be met. It shares no code with the kernels.
///
/// For a ray o + t d, |d| = 1, and a Gaussian with M = S^-1 R^T:
///   o_g = M (o - mean), d_g = M d, t = -o_g.d_g / d_g.d_g, p = o_g + t d_g,
///   alpha = min(0.99, sigmoid(opacity) exp(-4.5 (|p| / 3)^n)), n the kernel's degree (2: a Gaussian),
///   a hit where alpha >= alpha_min and t > near,
///   colour = sum_i T_i alpha_i c_i + T background, T_(i+1) = T_i (1 - alpha_i), hits in the order (t, id), until
///   T < transmittance_min (the hit that crosses counts) or max_hits of them.
/// Rays are those of any camera, in double: without one centre too, and none where a lens gives none. options.antialias
/// is the standard deviation of the pixels' filter. With it a Gaussian is first widened as math/widened.hpp defines it.
/// Backwards, with g = dL/dcolour and B_i the colour behind hit i with T = 1,
///   dL/dalpha_i = T_i g.(c_i - B_i),
/// the depth sum_i T_i alpha_i t_i likewise with t_i for c_i. There dL/dt_i = T_i alpha_i dL/ddepth besides. A clamp
/// that holds (alpha at 0.99, a colour at 0) passes nothing. Gaussians that the renderer culls are none here either.
/// Their parameters are not finite, their quaternion has no direction, or a log-scale lies outside (-40, 40).
///
/// Pixels are traced in blocks of 16 x 16. A block leaves out a Gaussian only where the sphere around its ellipsoid
/// misses the cone around the block's rays. Cost: Gaussians x blocks for that test. A pixel costs a sort and about 100
/// operations for each Gaussian that stays; on all cores. Memory: 112 bytes a Gaussian, and the gradients. The sums are
/// added in the order of the blocks, so that the same call gives the same bits.

#include <gart/core/span.hpp>
#include <gart/render/options.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <vector>

namespace gart {

/// The shapes of gaussian_model, in double.
struct reference_gradients {
  int sh_degree = 0;                                             ///< of the model
  std::vector<double> mean, log_scale, quaternion, opacity, sh;  ///< as in gaussian_model
};

/// One entry for each pixel that was asked for, in that order.
struct reference_image {
  std::vector<double> color;                 ///< [n][3], background composited
  std::vector<double> transmittance, depth;  ///< [n]; depth: sum of weight * t
  std::vector<u32> hits;                     ///< [n]
  reference_gradients gradients;             ///< empty where no gradient was asked for
};

/// y * width + x of every pixel of a camera.
std::vector<u32> all_pixels(camera const& view);

/// The pixels `pixels` of a view, each at most once; bands above `active_degree` are not evaluated. With a
/// `color_gradient`, dL/dcolour as [n][3], also the gradient of every parameter, summed over these pixels. A
/// `depth_gradient`, dL/ddepth as [n], adds that of the depth. Errors: invalid_argument for a pixel outside the image
/// or named twice, and for a gradient of another size. Also for a degree the model does not have. Also for a pixel
/// where a lens of k1, k2, p1 and p2 has no inverse. unsupported for a filter of pixels through any other camera than a
/// pinhole and such a lens.
reference_image trace_reference(gaussian_model const& model, camera const& view, render_options const& options,
                                int active_degree, std::vector<u32> const& pixels,
                                std::vector<double> const& color_gradient = {}, int kernel_degree = 2,
                                std::vector<double> const& depth_gradient = {});

}  // namespace gart
