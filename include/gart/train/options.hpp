#pragma once
/// \file
/// Everything a training run is made of besides the data, with the defaults of the literature (3DGS, 3DGS-MCMC,
/// gsplat).

#include <gart/comm/row_owners.hpp>
#include <gart/core/names.hpp>
#include <gart/core/types.hpp>
#include <gart/lens/options.hpp>
#include <gart/optim/options.hpp>
#include <gart/pose/options.hpp>
#include <gart/render/options.hpp>

#include <string>
#include <vector>

namespace gart {

/// How the number of Gaussians grows: not at all, where the image's error is (train/densify/error_growth.hpp), by MCMC
/// (train/densify/mcmc.hpp), by adaptive density control (train/densify/adc.hpp).
enum class densify_kind { none, error, mcmc, adc };
/// Their names.
constexpr auto names_of(densify_kind) {
  using enum densify_kind;
  return std::array<name_of<densify_kind>, 4>{{{error, "error"}, {mcmc, "mcmc"}, {adc, "adc"}, {none, "none"}}};
}

/// What is behind the scene in training; `random`: another colour in each step.
enum class background_kind { black, white, random };
/// Their names.
constexpr auto names_of(background_kind) {
  using enum background_kind;
  return std::array<name_of<background_kind>, 3>{{{white, "white"}, {black, "black"}, {random, "random"}}};
}

/// The size of a step's images (train/resolution.hpp). Shares are of the run, and of a long one's first steps: what it
/// has more are at full size.
struct resolution_options {
  float quarter_until = 0.1f;  ///< until then a quarter of a photograph's pixels across and down
  float half_until = 0.5f;     ///< until then half
  int least = 128;             ///< never fewer pixels across or down
  int long_run = 15000;        ///< steps that a longer run's shares are of
};

/// The options of a run.
struct train_options {
  int iterations = 30000;                      ///< steps of the run
  index_t max_gaussians = 1'000'000;           ///< never more than these
  index_t random_points = 100'000;             ///< where the capture has no points
  densify_kind densify = densify_kind::error;  ///< how their number grows
  /// Weight of the square of the bands of colour above the first, halved and in the mean over the Gaussians, in the loss
  /// (optim/adam.hpp). Rates of bands can then be eight times those of 3DGS without noise.
  float sh_penalty = 0.01f;
  int sh_every = 1000;  ///< a degree more after so many steps (or iterations / (10 * degrees) in shorter runs)
  std::vector<std::size_t> held_out = {};               ///< training views, by index, that are not trained on
  background_kind background = background_kind::black;  ///< behind the scene
  /// Of the first Gaussians; the scale is times the distance to the neighbours. 0: what suits the start
  /// (runtime/choose.hpp).
  float initial_opacity = 0;
  float initial_scale = 0;   ///< times the distance to the neighbours; 0 as above
  float ssim_weight = 0.2f;  ///< share of D-SSIM in the loss, the rest is L1
  float dropout = 0;         ///< share of the Gaussians that each step leaves out (optim/dropout.hpp)
  float dropout_until = 1;   ///< share of the run after which steps leave out none
  /// Of the depth's loss beside the colours', in units of the scene's extent (loss/depth_loss.hpp); 0: depth is not
  /// looked at. The dataset must have maps (dataset_options.depth).
  float depth_weight = 0;
  bool exposure = false;      ///< learn an exposure of each training view (exposure/exposure.hpp)
  bool vignetting = false;    ///< learn the falloff of each lens (exposure/vignetting.hpp)
  bool refine_poses = false;  ///< learn the pose of each training view (pose/pose_training.hpp)
  bool refine_lens = false;   ///< learn the focal length and centre of each camera (lens/lens_training.hpp)
  /// Bytes of the LT buffer above which a step is done with less; 0: half of what is free when the trainer is made,
  /// and no limit where sums are to be in a fixed order.
  u64 lt_budget = 0;
  /// After each step parameters and Adam's moments are searched for what is not finite, and not_finite is thrown at the
  /// first (optim/finite.hpp).
  bool check_finite = false;
  /// Views a step: the mean of their gradients, by rates times sqrt(batch) (optim/adam.hpp). All that is counted in
  /// steps, `iterations` too, then counts images. Needs a trainer with a communicator.
  int batch = 1;
  index_t shard_block = row_owners::default_block;  ///< Gaussians in a row that one of several ranks has
  u64 seed = 1;                                     ///< of all numbers drawn at random
  float near = 0.002f;                              ///< hits lie at t > near, times the scene's extent
  resolution_options resolution = {};               ///< of a step's images
  approximation_options render = {};                ///< what is traded for time
  learning_rates rates = {};                        ///< of Adam, by group of parameters
  adam_options adam = {};                           ///< of Adam
  pose_options poses = {};                          ///< of learned poses
  lens_options lens = {};                           ///< of learned lenses
  error_growth_options error = {};                  ///< of growth by error
  mcmc_options mcmc = {};                           ///< of growth by MCMC
  adc_options adc = {};                             ///< of adaptive density control
};

/// What a scene of that extent is traced with.
inline render_options render_options_of(train_options const& options, float extent, vec3 background = vec3(0.0f)) {
  return {options.render, options.near * extent, background};
}

}  // namespace gart
