#pragma once
/// \file
/// Everything the next step of a training run depends on, in host memory, and its way into a checkpoint and back.
/// Numbers drawn at random are functions of (seed, step) and need no room in it.
///
/// Errors: read_checkpoint throws io_error naming the file and the array that is missing, truncated or of another size.

#include <gart/core/named_arrays.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <string>

namespace gart {

/// A run between two steps.
struct training_state {
  gaussian_model scene,  ///< the parameters
      first,             ///< Adam's first moment of each
      second;            ///< and its second
  int step = 0;          ///< steps done
  vec3d origin{0.0};     ///< of the coordinates (io/origin.hpp)
  u64 seed = 1;          ///< of all numbers drawn at random
  named_arrays parts;    ///< of the densifier, and of what is learned besides the Gaussians
};

/// Whether the array of a part has a number of 4 bytes for each Gaussian, or none: those whose names begin with
/// "gaussians/", and three that are older than this rule. All others are of the run.
inline bool of_gaussians(std::string const& name) {
  return name.starts_with("gaussians/") || name == "error_growth/error_sum" || name.starts_with("adc/");
}

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
