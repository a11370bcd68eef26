#pragma once
/// \file
/// The state of a training run in host memory: everything the next step depends on. Also its checkpoint's writer and
/// reader. Random draws are functions of (seed, step) and need no state.
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
      first,             ///< Adam's first moments
      second;            ///< Adam's second moments
  int step = 0;          ///< steps done
  vec3d origin{0.0};     ///< of the coordinates (io/origin.hpp)
  u64 seed = 1;          ///< of all random draws
  named_arrays parts;    ///< of the densifier, and of what is learned besides the Gaussians
};

/// Whether a part's array holds one number of 4 bytes for each Gaussian. Such names begin with "gaussians/"; three
/// older names are exceptions. Other arrays belong to the run.
inline bool of_gaussians(std::string const& name) {
  return name.starts_with("gaussians/") || name == "error_growth/error_sum" || name.starts_with("adc/");
}

/// Written to a temporary name, then renamed. Errors: io_error.
void write_checkpoint(std::filesystem::path const& path, training_state const& state);
/// The state of a checkpoint of any degree.
training_state read_checkpoint(std::filesystem::path const& path);
/// io_error where the checkpoint is of another degree.
training_state read_checkpoint(std::filesystem::path const& path, int sh_degree);
/// The same for a state that was read from this checkpoint.
void require_degree(std::filesystem::path const& path, training_state const& state, int sh_degree);
/// And of another seed.
void require_seed(std::filesystem::path const& path, training_state const& state, u64 seed);

}  // namespace gart
