#pragma once
/// \file
/// Everything the next step of a training run depends on, in host memory, and its way into a checkpoint and back.
/// Numbers drawn at random are functions of (seed, step) and need no room in it.
///
/// Errors: read_checkpoint throws io_error naming the file and the array that is missing, truncated or of another size.

#include <gart/exposure/exposure.hpp>
#include <gart/exposure/vignetting.hpp>
#include <gart/lens/lens_state.hpp>
#include <gart/pose/pose.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <vector>

namespace gart {

/// A run between two steps.
struct training_state {
  gaussian_model scene,             ///< the parameters
      first,                        ///< Adam's first moment of each
      second;                       ///< and its second
  int step = 0;                     ///< steps done
  float growth = 1;                 ///< of MCMC, a densification
  vec3d origin{0.0};                ///< of the coordinates (io/origin.hpp)
  u64 seed = 1;                     ///< of all numbers drawn at random
  std::vector<float> error_sum;     ///< growth by error's statistic since it last densified: [N], or empty
  std::vector<float> gradient_sum;  ///< adaptive density's statistic since it last densified: [N], or empty
  std::vector<u32> touched;         ///< how many gradients each Gaussian had since it last densified: [N], or empty
  exposure_state exposures;         ///< learned, or empty
  vignetting_state vignetting;      ///< learned, or empty
  pose_state poses;                 ///< learned, or empty
  lens_state lenses;                ///< learned, or empty
};

/// What of a state is not of each Gaussian.
training_state without_rows(training_state const& state);

/// Written to a temporary name, then renamed. Errors: io_error.
void write_checkpoint(std::filesystem::path const& path, training_state const& state);
/// The state of a checkpoint of any degree.
training_state read_checkpoint(std::filesystem::path const& path);
/// io_error where the checkpoint is of another degree.
training_state read_checkpoint(std::filesystem::path const& path, int sh_degree);
/// The same of a state that was read of this checkpoint.
void require_degree(std::filesystem::path const& path, training_state const& state, int sh_degree);

}  // namespace gart
