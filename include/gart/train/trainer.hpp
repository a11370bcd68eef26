#pragma once
/// \file
/// Training, one step at a time: a view, the forward pass, the loss, the backward pass by the strategy, Adam,
/// densification. Composed from the parts; each can be replaced. A loss of one's own is a callable given to step().
///
///   openmp_exec exec;
///   trainer<openmp_exec, scene_traits<3>, bvh_tracer<openmp_exec>, pixel_strategy> run(exec, options, data, start);
///   while (run.steps_done() < options.iterations) run.step();
///   write_splat_ply("model.ply", run.model());
///
/// The policy, the options' dataset and its images must outlive the trainer. Randomness is a function of (seed, step),
/// so a state holds parameters, moments and counters only.

#include <gart/backward/fallback.hpp>
#include <gart/exposure/exposure_field.hpp>
#include <gart/exposure/exposure_training.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/error_map.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/optim/adam.hpp>
#include <gart/optim/adc.hpp>
#include <gart/optim/error_growth.hpp>
#include <gart/optim/finite.hpp>
#include <gart/optim/mcmc.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/pose/pose_training.hpp>
#include <gart/render/frame.hpp>
#include <gart/render/render_image.hpp>
#include <gart/scene/traits.hpp>
#include <gart/train/options.hpp>
#include <gart/train/state.hpp>
#include <gart/train/step_report.hpp>
#include <gart/train/training_images.hpp>
#include <gart/train/view_order.hpp>

#include <optional>

namespace gart::inline GART_ISA {

/// What a loss sees: the rendered image and its view, in the policy's memory. It writes dL/d image and, into
/// value[0..1], the loss and the mean squared error.
template <execution E>
struct loss_input {
  E& exec;                   ///< the policy
  dataset_view const& view;  ///< of this step
  truth_view truth;          ///< the photograph, in the policy's memory
  int width, height;         ///< of the image, in pixels
  span<float const> image;   ///< [H][W][3]
  span<float> gradient;      ///< [H][W][3]
  span<float> value;         ///< [2]
};

/// A training run on one policy, by one tracer and one strategy.
template <execution E, class Traits, class Tracer, strategy Strategy>
class trainer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< of the coefficients that are stored

  /// Starts from `start`, of that degree. Errors: invalid_argument for another degree, or where no view is left to
  /// train on; out_of_memory.
  trainer(E& exec, train_options const& options, dataset const& data, gaussian_model const& start);
  /// The dataset must outlive the trainer.
  trainer(E& exec, train_options const& options, dataset const&& temporary, gaussian_model const& start) = delete;

  /// One step, with the loss of the options.
  step_report step();
  /// One step, with a loss of one's own, called with a loss_input.
  template <class Loss>
  step_report step(Loss&& loss);

  /// Steps done.
  int steps_done() const { return step_; }
  void set_iterations(int iterations);  ///< as session has it
  /// The Gaussians, in host memory.
  gaussian_model model() const { return scene_.to_host(); }
  /// A view of the Gaussians to host memory.
  rendered render(camera const& view, vec3 background);
  /// Everything the next step depends on.
  training_state state() const;
  /// Takes up the run that the state is of. Errors: invalid_argument for another degree.
  void set_state(training_state const& state);
  /// Writes the state to a checkpoint.
  void save(std::filesystem::path const& path) const { write_checkpoint(path, state()); }
  /// Takes up the run of a checkpoint.
  void load(std::filesystem::path const& path) { set_state(read_checkpoint(path, sh_degree)); }
  exposure_field exposures() const;         ///< of the views that were trained on; empty where none are learned
  std::vector<named_camera> poses() const;  ///< of the training views; empty where none are learned
  std::size_t lt_bytes() const { return lt_bytes_; }  ///< of the last step
  /// The Gaussians, in the policy's memory.
  gaussians<E>& scene() { return scene_; }
  /// Of the last step, in their shape.
  gaussians<E> const& gradients() const { return gradients_; }

 private:
  using frame_type = frame<E, Traits, Tracer>;

  template <class Pass, class Loss>
  void differentiate_by(Pass& pass, Loss&& loss, std::size_t view, learning_rates const& rates);
  void update(camera const& view, learning_rates const& rates, int degree, span<float const> moments);
  bool grows_by_error() const { return options_.densify == densify_kind::error; }
  vec3 background_of(int step) const;
  static mcmc_options mcmc_options_of(train_options const& options) {
    mcmc_options m = options.mcmc;
    m.dead_opacity = least_opacity(m.dead_opacity, options.render.alpha_min);
    return m;
  }
  static error_growth_options error_options_of(train_options const& options) {
    error_growth_options e = options.error;
    e.dead_opacity = least_opacity(e.dead_opacity, options.render.alpha_min);
    return e;
  }
  static adc_options adc_options_of(train_options const& options) {
    adc_options a = options.adc;
    a.prune_opacity = least_opacity(a.prune_opacity, options.render.alpha_min);
    return a;
  }

  E& exec_;
  train_options options_;
  dataset const& data_;
  gaussians<E> scene_, gradients_;
  optimizer_state<E> state_;
  frame_type frame_;
  backward_passes<frame_type, Strategy> passes_;
  image_loss<E> loss_;
  training_images<E> images_;
  view_order order_;
  error_growth<E> error_;
  buffer<float, E> error_map_;  // of the step's image, where densification asks for it
  mcmc<E> mcmc_;
  adaptive_density<E> adc_;
  buffer<float, E> color_, color_gradient_, value_;
  std::optional<exposure_training<E>> exposures_;  // where options.exposure asks for them
  buffer<float, E> depth_, transmittance_;         // of the step's image, where a pose asks for them
  std::optional<pose_training> poses_;             // where options.refine_poses asks for them
  pose_differentiation<E> by_pose_;
  std::optional<finite_check<E>> finite_;  // where options.check_finite asks for it
  index_t started_with_ = 0;               // Gaussians
  int step_ = 0;
  float growth_ = 1;
  std::size_t lt_bytes_ = 0;
};

}  // namespace gart::inline GART_ISA

#include <gart/train/trainer_impl.hpp>
