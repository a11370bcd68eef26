#pragma once
// Everything the next step of a training run depends on, in host memory, and its way into a checkpoint and back.
// Numbers drawn at random are functions of (seed, step) and need no room in it.
//
// Errors: read_checkpoint throws io_error naming the file and the array that is missing, truncated or of another size.

#include <gart/exposure/exposure.hpp>
#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace gart {

// What a trial of one band of spherical harmonics found (runtime/degree_selection.hpp). PSNR in dB, the mean over the
// views held out.
struct band_trial {
  int band = 0;         // the degree whose coefficients were tried
  int step = 0;         // steps done when the two branches parted
  double with = 0;      // PSNR where the branch that kept the band ended
  double without = 0;   // and where the other did
  double forecast = 0;  // the gain to be expected at the end of the run
  double gain_wanted = 0;
  double error = 0;  // standard error of the gain, from how far the views that judged it differ

  static constexpr double tellable = 0.05;  // dB
  double gain() const { return with - without; }
  // A gain that is not told to 0.05 dB, or to what is wanted of it, is no reason to drop the band.
  bool told() const { return error <= std::max(gain_wanted, tellable); }
  bool kept() const { return !(forecast < gain_wanted) || !told(); }
};

struct training_state {
  gaussian_model scene, first, second;  // parameters, and Adam's moments in their shape
  int step = 0;                         // steps done
  float growth = 1;                     // of MCMC, a densification
  u64 seed = 1;
  std::vector<float> error_sum;     // growth by error's statistic since it last densified: [N], or empty
  std::vector<float> gradient_sum;  // adaptive density's statistic since it last densified: [N], or empty
  std::vector<u32> touched;
  exposure_state exposures;
  std::vector<band_trial> trials;  // that are over
};

training_state with_sh_degree(training_state state, int degree);

void write_checkpoint(std::filesystem::path const& path, training_state const& state);
training_state read_checkpoint(std::filesystem::path const& path);
// io_error where the checkpoint is of another degree.
training_state read_checkpoint(std::filesystem::path const& path, int sh_degree);

}  // namespace gart
