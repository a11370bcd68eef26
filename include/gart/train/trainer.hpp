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
/// On several ranks the Gaussians are spread over them, with their moments (comm/row_owners.hpp), and each takes a part
/// of every step (shard/work_units.hpp): strips of one view, or views of a batch. With a strategy that is `ordered` the
/// bits of a run are those of any number of ranks. All ranks make the same calls; what is said of the Gaussians is of
/// all of them, but for scene() and gradients(), which are of this rank's rows. docs/backends.md has more.
///
///   mpi_comm ranks;
///   trainer<openmp_exec, traits, tracer, deterministic_strategy, mpi_comm> run(exec, options, data, start, ranks);
///
/// The policy, the options' dataset and its images must outlive the trainer. Randomness is a function of (seed, step),
/// so a state holds parameters, moments and counters only.

#include <gart/backward/fallback.hpp>
#include <gart/comm/self_comm.hpp>
#include <gart/exposure/exposure_field.hpp>
#include <gart/exposure/exposure_training.hpp>
#include <gart/exposure/vignetting_training.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/lens/lens_training.hpp>
#include <gart/loss/error_map.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/optim/adam.hpp>
#include <gart/optim/adc.hpp>
#include <gart/optim/dropout.hpp>
#include <gart/optim/error_growth.hpp>
#include <gart/optim/finite.hpp>
#include <gart/optim/mcmc.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/pose/pose_training.hpp>
#include <gart/render/frame.hpp>
#include <gart/render/render_image.hpp>
#include <gart/scene/traits.hpp>
#include <gart/train/checkpoint_part.hpp>
#include <gart/train/depth_supervision.hpp>
#include <gart/train/foreground_fraction.hpp>
#include <gart/train/memory_need.hpp>
#include <gart/train/min_pixel_filter.hpp>
#include <gart/train/options.hpp>
#include <gart/train/resolution.hpp>
#include <gart/train/shards.hpp>
#include <gart/train/start_model.hpp>
#include <gart/train/state.hpp>
#include <gart/train/step_report.hpp>
#include <gart/train/training_images.hpp>
#include <gart/train/view_order.hpp>

#include <functional>
#include <optional>

namespace gart::inline GART_ISA {

/// What a loss sees: the rendered image and its view, in the policy's memory. It writes dL/d image and, into
/// value[0..1], the loss and the mean squared error.
template <execution E>
struct loss_input {
  E& exec;                   ///< the policy
  dataset_view const& view;  ///< of this step, as the capture has it
  truth_view truth;          ///< the photograph at the image's size, in the policy's memory
  int width, height;         ///< of the image, in pixels
  span<float const> image;   ///< [H][W][3]
  span<float> gradient;      ///< [H][W][3]
  span<float> value;         ///< [2]
  depth_pixels depth;        ///< to add to, of a strategy with_depth; else empty
};

/// A loss, called once a step: by its type a trainer would be compiled again for each.
template <execution E>
using loss_function = std::function<void(loss_input<E> const&)>;

/// A training run on one policy, by one tracer and one strategy, on the ranks of a communicator.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
requires communicator<Comm, E>
class basic_trainer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< that rows of coefficients have room for

  /// Starts from `start`, of that degree or a lower one, which the run keeps. Errors: invalid_argument for a higher
  /// degree, or where no view is left to train on, and for options that several ranks do not have; out_of_memory.
  basic_trainer(E& exec, train_options const& options, dataset const& data, start_model const& start,
                Comm comm = Comm());
  /// The dataset must outlive the trainer.
  basic_trainer(E& exec, train_options const& options, dataset const&& temporary, start_model const& start,
                Comm comm = Comm()) = delete;

  /// One step, with the loss of the options.
  step_report step();
  /// One step, with a loss of one's own, called with a loss_input.
  template <class Loss>
  step_report step(Loss&& loss) {
    loss_function<E> const own = std::ref(loss);
    return step_by(&own);
  }

  /// Of the run's model; bands above it are zero in the policy's memory.
  int degree() const { return degree_; }
  /// Steps done.
  int steps_done() const { return step_; }
  void set_iterations(int iterations);  ///< as session has it
  /// The Gaussians, in host memory.
  gaussian_model model() const { return whole_of(model_part()); }
  /// A view of the Gaussians to host memory.
  rendered render(camera const& view, vec3 background);
  /// Its colours alone, in 8 bits a channel: [H][W][3].
  image8 render_8bit(camera const& view, vec3 background);
  /// Gaussians, of all ranks.
  index_t size() const { return total_; }
  /// Everything the next step depends on.
  training_state state() const { return whole_of(part()); }
  /// Takes up the run that the state is of. Errors: invalid_argument for another degree.
  void set_state(training_state const& state) { set_part(part_of(state)); }
  /// Writes the state to a checkpoint: one file, whatever the number of ranks, each of which writes its rows.
  void save(std::filesystem::path const& path) const { write_part(path, part()); }
  /// Takes up the run of a checkpoint, of which each rank reads its rows.
  void load(std::filesystem::path const& path);
  /// Writes the Gaussians in the format that the name's ending says; ranks write a splat PLY each its rows, of another
  /// format rank 0 all.
  void save_model(std::filesystem::path const& path, splat_traits const& traits = {}) const {
    write_part(path, model_part(), traits);
  }

  ///@{
  /// Of a rank's part, as session has them.
  training_state part() const;
  gaussian_model model_part() const { return with_sh_degree(scene_.to_host(), degree_); }
  void set_part(training_state const& mine);
  void write_part(std::filesystem::path const& path, training_state const& mine) const;
  void write_part(std::filesystem::path const& path, gaussian_model const& mine, splat_traits const& traits) const;
  training_state read_part(std::filesystem::path const& path) const;
  training_state whole_of(training_state const& mine) const;
  ///@}
  /// Of the views that were trained on and their lenses; empty where none are learned.
  exposure_field exposures() const;
  /// The cameras of the training views, where poses or lenses are learned; else empty.
  std::vector<named_camera> poses() const;
  /// A camera of the capture, at whatever pose, with its lens as it is learned.
  camera as_learned(camera const& view) const { return lenses_ ? lenses_->view(view) : view; }
  std::size_t lt_bytes() const { return lt_bytes_; }  ///< of the last step
  /// Bytes that this rank has sent to others in its steps.
  u64 sent_bytes() const requires(!Comm::alone) { return shards_.sent; }
  /// The Gaussians, in the policy's memory, in rows of sh_degree.
  gaussians<E>& scene() { return scene_; }
  /// Of the last step, in their shape; where it changed the count of the Gaussians, undefined.
  gaussians<E> const& gradients() const {
    if constexpr (!Comm::alone) sum_arrived();
    return gradients_;
  }

 private:
  using frame_type = frame<E, Traits, Tracer>;

  // `loss`: one's own, or null.
  step_report step_by(loss_function<E> const* loss);
  template <class Pass>
  void differentiate_by(Pass& pass, loss_function<E> const* loss, std::size_t view, learning_rates const& rates);
  void evaluate(loss_function<E> const* loss, loss_input<E> const& in);
  template <class Rows>
  void optimize(learning_rates const& rates, int degree, Rows&& rows);
  // The step's image as the view's photograph would show it, and before its exposure.
  span<float const> photographed(std::size_t view) {
    if (vignetting_) vignetting_->shade(view, captured(view), color_);
    return exposures_ ? exposures_->expose(view, through_lens()) : through_lens();
  }
  span<float const> through_lens() const { return vignetting_ ? vignetting_->shaded() : span<float const>(color_); }
  learning_rates rates_of_step() const;
  void make_room();

  // With ranks (trainer_ranks_impl.hpp).
  void require_ranks() const;
  static train_options const& with_room(E& exec, Comm& comm, train_options const& options, dataset const& data,
                                        start_model const& start) {
    require_room(exec, comm, options, data, sh_degree, total_of(comm, start));
    return options;
  }
  static u64 total_of(Comm& comm, start_model const& start) {
    u64 total = start.rows.size();
    if (start.is_part) comm.all_reduce(span<u64>(&total, 1));
    return total;
  }
  step_report step_in_ranks(loss_function<E> const* loss) requires(!Comm::alone);
  void trace_unit(loss_function<E> const* loss, camera const& seen, int image, int degree, image_result& result,
                  step_report& report) requires(!Comm::alone);
  void differentiate_strip(camera const& seen, truth_view const& truth) requires(!Comm::alone);
  void read_result(image_result& result, bool metric, bool lens) requires(!Comm::alone);
  void collect_results(span<image_result> round, bool metrics, bool lens) requires(!Comm::alone);
  void take_gradients(std::vector<camera> const& views, int image, span<image_result> round,
                      bool learn_poses) requires(!Comm::alone);
  void move_parameters(adam_pass<E> const& adam) requires(!Comm::alone);
  void sum_arrived() const requires(!Comm::alone);
  rendered render_in_ranks(camera const& view, vec3 background) requires(!Comm::alone);
  bool in_ranks() const { return !Comm::alone && (comm_.size() > 1 || options_.batch > 1); }
  // Gaussians of the run's degree in the policy's memory.
  gaussians<E> in_rows(gaussian_model const& model) {
    if (model.sh_degree >= sh_degree) return gaussians<E>(exec_, model);
    return gaussians<E>(exec_, with_sh_degree(model, sh_degree));
  }
  static void assign_rows(gaussians<E>& to, gaussian_model const& from) {
    from.sh_degree == sh_degree ? to.assign(from) : to.assign(with_sh_degree(from, sh_degree));
  }
  // What of values of all Gaussians is this rank's, and the way back.
  decltype(auto) part_of(start_model const& start) const {
    if constexpr (Comm::alone)
      return (start.rows);
    else
      return start.is_part ? start.rows : shards_.rows.part_of(start.rows);
  }
  decltype(auto) part_of(training_state const& all) const {
    if constexpr (Comm::alone) {
      return (all);
    } else {
      training_state mine = without_rows(all);
      mine.scene = shards_.rows.part_of(all.scene);
      mine.first = shards_.rows.part_of(all.first), mine.second = shards_.rows.part_of(all.second);
      mine.error_sum = shards_.rows.part_of(all.error_sum, 1);
      mine.gradient_sum = shards_.rows.part_of(all.gradient_sum, 1);
      mine.touched = shards_.rows.part_of(all.touched, 1);
      return mine;
    }
  }
  gaussian_model whole_of(gaussian_model mine, int root = -1) const {
    if constexpr (Comm::alone)
      return mine;
    else
      return shards_.rows.whole_of(mine, root);
  }

  // The camera of a training view, with what is learned of it.
  camera seen_by(std::size_t index) const { return as_learned(poses_ ? poses_->view(index) : data_.train[index].view); }
  // A camera of the capture at the size of the step's images, by that factor of this view's.
  int shrink_of_view(std::size_t index) const {
    return shrink_of(data_.train[index].view, shrink_, options_.resolution);
  }
  camera at_size(camera const& c, std::size_t index) const {
    int const shrink = shrink_of_view(index);
    return shrink == 1 ? c : downscaled(c, shrink, data_.train[index].name);
  }
  camera traced(std::size_t index) const { return at_size(seen_by(index), index); }
  camera captured(std::size_t index) const { return at_size(data_.train[index].view, index); }
  std::array<double, 36> pose_metric_of(std::size_t index, span<float const> depth,
                                        span<float const> transmittance) const {
    return poses_->metric_of(at_size(poses_->view(index), index), depth, transmittance);
  }
  bool learns_poses() const { return poses_ && poses_->learns(step_, options_.iterations); }
  bool learns_lenses() const { return lenses_ && lenses_->learns(step_, options_.iterations); }

  bool grows_by_error() const { return options_.densify == densify_kind::error; }
  vec3 background_of(int step) const;
  static mcmc_options mcmc_options_of(train_options const& options) {
    mcmc_options m = options.mcmc;
    m.dead_opacity = least_opacity(m.dead_opacity, options.render.alpha_min);
    return m;
  }
  static error_growth_options error_options_of(train_options const& options, dataset const& data) {
    error_growth_options e = options.error;
    if (options.densify == densify_kind::error && e.opacity_penalty > 0)
      e.opacity_penalty *= penalty_scale(
          foreground_fraction(data, views_trained_on(data.train.size(), options.held_out), options.background));
    e.split.share = split_share(e, options.max_gaussians, data.training_pixels());
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
  int degree_;  // of the run's model
  mutable Comm comm_;
  mutable std::conditional_t<Comm::alone, no_shards, shards<E, Comm, Traits, Tracer>> shards_;
  gaussians<E> scene_;
  mutable gaussians<E> gradients_;
  optimizer_state<E> state_;
  frame_type frame_;
  backward_passes<frame_type, Strategy> passes_;
  image_loss<E> loss_;
  training_images<E> images_;
  view_order order_;
  dropout<E> dropout_;
  min_pixel_filter<E> min_pixel_filter_;
  error_growth<E> error_;
  buffer<float, E> error_map_;  // of the step's image, where densification asks for it
  mcmc<E> mcmc_;
  adaptive_density<E> adc_;
  buffer<float, E> color_, color_gradient_, value_;
  std::conditional_t<has_depth<Strategy>, depth_supervision<E>, no_depth_supervision> supervision_;
  std::optional<exposure_training<E>> exposures_;     // where options.exposure asks for them
  std::optional<vignetting_training<E>> vignetting_;  // and options.vignetting
  buffer<float, E> depth_, transmittance_;            // of the step's image, where a pose asks for them
  std::optional<pose_training> poses_;                // where options.refine_poses asks for them
  pose_differentiation<E> pose_backward_;
  std::optional<lens_training> lenses_;  // where options.refine_lens asks for them
  lens_differentiation<E> lens_backward_;
  std::optional<finite_check<E>> finite_;  // where options.check_finite asks for it
  index_t started_with_ = 0, total_ = 0;   // Gaussians of all ranks
  int step_ = 0, shrink_ = 1;              // of the step's images (resolution.hpp)
  float growth_ = 1;
  std::size_t lt_bytes_ = 0;
};

/// The same by itself, where no communicator is named. An alias, since nvcc makes of a class's default argument one of
/// each member template too.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm = self_comm>
using trainer = basic_trainer<E, Traits, Tracer, Strategy, Comm>;

}  // namespace gart::inline GART_ISA

#include <gart/train/trainer_impl.hpp>
#include <gart/train/trainer_ranks_impl.hpp>
#include <gart/train/trainer_state_impl.hpp>
