#pragma once
/// \file
/// All options of a training run, with the usual defaults (docs/training.md says from where).

#include <gart/comm/row_owners.hpp>
#include <gart/core/names.hpp>
#include <gart/core/types.hpp>
#include <gart/lens/options.hpp>
#include <gart/optim/options.hpp>
#include <gart/pose/options.hpp>
#include <gart/render/options.hpp>

#include <vector>

namespace gart {

/// How the number of Gaussians changes, if at all. By the images' error (train/densify/error_growth.hpp), by MCMC
/// (train/densify/mcmc.hpp), or by adaptive density control (train/densify/adc.hpp).
enum class densify_kind { none, error, mcmc, adc };
/// Their names.
constexpr auto names_of(densify_kind) {
  using enum densify_kind;
  return std::array<name_of<densify_kind>, 4>{{{error, "error"}, {mcmc, "mcmc"}, {adc, "adc"}, {none, "none"}}};
}

/// The background in training; `random`: another colour in each step.
enum class background_kind { black, white, random };
/// Their names.
constexpr auto names_of(background_kind) {
  using enum background_kind;
  return std::array<name_of<background_kind>, 3>{{{white, "white"}, {black, "black"}, {random, "random"}}};
}

/// The size of a step's images (train/resolution.hpp). Shares count from the run, at most from its first `long_run`
/// steps.
struct resolution_options {
  float quarter_until = 0.1f;  ///< until then a quarter of a photograph's pixels across and down
  float half_until = 0.5f;     ///< until then half
  int least = 128;             ///< never fewer pixels across or down
  int long_run = 15000;        ///< steps: shares of a longer run count from these
};

/// The options of a run.
struct train_options {
  int iterations = 30000;                      ///< steps of the run
  index_t max_gaussians = 1'000'000;           ///< never more than these
  index_t random_points = 100'000;             ///< where there are no points to start from
  densify_kind densify = densify_kind::error;  ///< how their number grows
  /// Weight in the loss of the halved square of the bands above the first, its mean over the Gaussians
  /// (optim/adam.hpp). Rates of bands can then be eight times those of 3DGS without noise.
  float sh_penalty = 0.01f;
  int sh_every = 1000;  ///< a degree more after so many steps (or iterations / (10 * degrees) in shorter runs)
  std::vector<std::size_t> held_out = {};               ///< training views, by index, that are not trained on
  background_kind background = background_kind::black;  ///< behind the scene
  /// The first Gaussians' opacity. 0: a value that suits the start (runtime/capture_defaults.hpp).
  float initial_opacity = 0;
  float initial_scale = 0;   ///< the first scale over the distance to the neighbours; 0 as above
  float ssim_weight = 0.2f;  ///< share of D-SSIM in the loss, the rest is L1
  float dropout = 0;         ///< share of the Gaussians that each step leaves out (optim/dropout.hpp)
  float dropout_until = 1;   ///< share of the run after which steps leave out none
  /// Weight of the depth loss, in units of the scene's extent (loss/depth_loss.hpp); 0: depth is not used. The dataset
  /// must have maps (dataset_options.depth).
  float depth_weight = 0;
  bool match = false;         ///< start from dataset::matched too (runtime/matched_points.hpp)
  bool exposure = false;      ///< learn an exposure of each training view (exposure/exposure.hpp)
  bool vignetting = false;    ///< learn the falloff of each lens (exposure/vignetting.hpp)
  bool refine_poses = false;  ///< learn the pose of each training view (pose/pose_training.hpp)
  bool refine_lens = false;   ///< learn the focal length and centre of each camera (lens/lens_training.hpp)
  /// Largest bytes of the hit buffer; a step that needs more computes with less memory. 0: half of the memory that is
  /// free at the start, and no limit for methods with ordered sums.
  u64 hit_memory = 0;
  /// Whether each step ends with a search for numbers that are not finite, in parameters and Adam's moments. The first
  /// one found throws not_finite (optim/finite.hpp).
  bool check_finite = false;
  /// Views a step. Adam takes the mean of their gradients, with rates times sqrt(batch) (optim/adam.hpp). `iterations`
  /// and all other counts of steps then count images. Needs a trainer with a communicator.
  int batch = 1;
  index_t shard_block = row_owners::default_block;  ///< consecutive Gaussians on one rank
  u64 seed = 1;                                     ///< of all numbers drawn at random
  float near = 0.002f;                              ///< hits lie at t > near, times the scene's extent
  resolution_options resolution = {};               ///< of a step's images
  render_options render = {};                       ///< of a step's views; near, background and rows are the run's own
  learning_rates rates = {};                        ///< of Adam, by group of parameters
  adam_options adam = {};                           ///< how its steps differ by Gaussian and band
  pose_options poses = {};                          ///< of learned poses
  lens_options lens = {};                           ///< of learned lenses
  error_growth_options error = {};                  ///< of growth by error
  mcmc_options mcmc = {};                           ///< of growth by MCMC
  adc_options adc = {};                             ///< of adaptive density control
};

/// The render options for a scene of this extent.
inline render_options render_options_of(train_options const& options, float extent, vec3 background = vec3(0.0f)) {
  render_options render = options.render;
  render.near = options.near * extent, render.background = background, render.rows = {};
  return render;
}

}  // namespace gart
