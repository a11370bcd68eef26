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

#include <algorithm>
#include <filesystem>
#include <vector>

namespace gart {

/// What a trial of one band of spherical harmonics found (runtime/degree_selection.hpp). PSNR in dB, the mean over the
/// views held out.
struct band_trial {
  int band = 0;            ///< the degree whose coefficients were tried
  int step = 0;            ///< steps done when the two branches parted
  double with = 0;         ///< PSNR where the branch that kept the band ended
  double without = 0;      ///< and where the other did
  double forecast = 0;     ///< the gain to be expected at the end of the run
  double gain_wanted = 0;  ///< in dB: train_options.sh_gain
  double error = 0;        ///< standard error of the gain, from how far the views that judged it differ

  static constexpr double tellable = 0.05;  ///< dB
  /// In dB.
  double gain() const { return with - without; }
  /// A gain that is not told to 0.05 dB, or to what is wanted of it, is no reason to drop the band.
  bool told() const { return error <= std::max(gain_wanted, tellable); }
  /// Whether the band is stored.
  bool kept() const { return !(forecast < gain_wanted) || !told(); }
};

/// A run between two steps.
struct training_state {
  gaussian_model scene,             ///< the parameters
      first,                        ///< Adam's first moment of each
      second;                       ///< and its second
  int step = 0;                     ///< steps done
  float growth = 1;                 ///< of MCMC, a densification
  u64 seed = 1;                     ///< of all numbers drawn at random
  std::vector<float> error_sum;     ///< growth by error's statistic since it last densified: [N], or empty
  std::vector<float> gradient_sum;  ///< adaptive density's statistic since it last densified: [N], or empty
  std::vector<u32> touched;         ///< how many gradients each Gaussian had since it last densified: [N], or empty
  exposure_state exposures;         ///< learned, or empty
  vignetting_state vignetting;      ///< learned, or empty
  pose_state poses;                 ///< learned, or empty
  lens_state lenses;                ///< learned, or empty
  std::vector<band_trial> trials;   ///< that are over
};

/// The state with bands above `degree` dropped, or zero bands added, moments too.
training_state with_sh_degree(training_state state, int degree);
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
