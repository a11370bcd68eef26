#pragma once
/// \file
/// Training, one step at a time: a view, forward pass, loss, backward pass by the method, Adam, densification. Each of
/// these parts can be replaced.
///
///   openmp_exec exec;
///   trainer<openmp_exec, scene_traits<3>, bvh_tracer<openmp_exec>, pixel_method> run(exec, options, data, start);
///   while (run.steps_done() < options.iterations) run.step();
///   write_splat_ply("model.ply", run.model());
///
/// A program may bring its own loss (step()), densifier (densify_by(), train/densify/densifier.hpp) and learned part
/// (learn(), train/learned/part.hpp). It may set hooks between the parts of a step.
///
/// A step is a plan of units: on one rank a whole view (train/plan/whole_view.hpp). Several ranks share the Gaussians
/// and their moments (comm/row_owners.hpp). Each rank takes a part of every step: strips of one view, or views of a
/// batch (train/plan/rank_units.hpp). With an `ordered` method the bits do not depend on the number of ranks. All
/// ranks make the same calls. Results describe all Gaussians; scene(), edit() and gradients() concern this rank's rows.
/// docs/backends.md has more.
///
///   mpi_comm ranks;
///   trainer<openmp_exec, traits, tracer, deterministic_method, mpi_comm> run(exec, options, data, start, ranks);
///
/// The policy, the options' dataset and its images must outlive the trainer. Randomness is a function of (seed, step).

#include <gart/backward/fallback.hpp>
#include <gart/comm/self_comm.hpp>
#include <gart/exec/early_copy.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/optim/dropout.hpp>
#include <gart/optim/finite.hpp>
#include <gart/render/frame.hpp>
#include <gart/render/render_image.hpp>
#include <gart/scene/traits.hpp>
#include <gart/train/checkpoint_part.hpp>
#include <gart/train/densify/densifiers.hpp>
#include <gart/train/hooks.hpp>
#include <gart/train/learned/parts.hpp>
#include <gart/train/memory_need.hpp>
#include <gart/train/min_pixel_filter.hpp>
#include <gart/train/option_fields.hpp>
#include <gart/train/plan/rank_units.hpp>
#include <gart/train/plan/whole_view.hpp>
#include <gart/train/resolution.hpp>
#include <gart/train/start_model.hpp>
#include <gart/train/state.hpp>
#include <gart/train/step_report.hpp>
#include <gart/train/training_images.hpp>
#include <gart/train/view_order.hpp>

namespace gart { inline namespace GART_ISA {

/// A training run on one policy, by one tracer and one method, on the ranks of a communicator.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
class basic_trainer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< the largest degree that rows of coefficients hold
  using frame_type = frame<E, Traits, Tracer>;         ///< the frame of a step's image

  /// Starts from `start`, whose degree the run keeps: sh_degree or lower. Errors: invalid_argument for a higher degree,
  /// for no view to train on, and for options that several ranks refuse. out_of_memory.
  basic_trainer(E& exec, train_options const& options, dataset const& data, start_model const& start,
                Comm comm = Comm());
  /// The dataset must outlive the trainer.
  basic_trainer(E& exec, train_options const& options, dataset const&& temporary, start_model const& start,
                Comm comm = Comm()) = delete;

  /// One step, with the loss of the options. A device may still be at its end; what is queued next comes after it.
  step_report step() { return step_by(nullptr); }
  /// One step with the caller's loss, which gets a loss_input.
  template <class Loss>
  step_report step(Loss&& loss) {
    loss_function<E> const own = std::ref(loss);
    return step_by(&own);
  }
  /// Called in every step from the next on.
  void set_hooks(training_hooks<E> hooks) { progress_.hooks = std::move(hooks); }
  /// Replaces the options' densifier.
  void densify_by(std::unique_ptr<densifier<E>> own);
  /// Adds a learned part from the next step on; it sees images after the parts before it.
  void learn(std::unique_ptr<learned_part<frame_type>> part) {
    if (!part) throw invalid_argument("trainer.learn: there is no part");
    parts_.push_back(std::move(part));
  }

  /// The degree of the run's model; bands above it are zero in the policy's memory.
  int degree() const { return gaussians_.degree; }
  /// Steps done.
  int steps_done() const { return progress_.step; }
  void set_iterations(int iterations);  ///< as session::set_iterations
  /// The Gaussians, in host memory.
  gaussian_model model() const { return gather_all(gaussians_.to_host(gaussians_.model)); }
  /// Renders a view to host memory.
  rendered render(camera const& view, vec3 background);
  /// The view's colours in 8 bits a channel: [H][W][3].
  image8 render_8bit(camera const& view, vec3 background);
  /// The number of Gaussians on all ranks.
  index_t size() const { return gaussians_.total; }
  /// Everything the next step depends on.
  training_state state() const;
  /// Takes up the run of a state. Errors: invalid_argument for another degree, or other parts.
  void set_state(training_state const& state);
  /// Writes the state to a checkpoint: one file, to which each rank writes its rows.
  void save(std::filesystem::path const& path) const;
  /// Takes up the run of a checkpoint; each rank reads its rows.
  void load(std::filesystem::path const& path);
  /// Writes the Gaussians in the format of the name's ending. Each rank writes its rows of a splat PLY; rank 0 writes
  /// other formats whole.
  void save_model(std::filesystem::path const& path, splat_traits const& traits = {}) const;
  /// The learned exposures of the training views and their lenses; empty where none are learned.
  exposure_field exposures() const;
  /// The cameras of the training views, where poses or lenses are learned; else empty.
  std::vector<named_camera> poses() const;
  /// A camera of the capture, at any pose, with its learned lens.
  camera as_learned(camera view) const {
    for (auto const& part : parts_) view = part->through(view);
    return view;
  }
  std::size_t hit_buffer_bytes() const { return progress_.hit_buffer_bytes; }  ///< of the last step
  u64 sent_bytes() const { return progress_.sent; }  ///< sent by this rank to others in its steps
  /// The Gaussians, in the policy's memory, in rows of sh_degree.
  gaussians<E> const& scene() const { return gaussians_.model; }
  /// The same, to be changed.
  gaussians_view<float> edit() { return gaussians_.model.view(); }
  /// Sets the number of Gaussians on all ranks. New ones and their moments are zero until edit() changes them.
  void resize(index_t total);
  /// The last step's gradients, in the Gaussians' shape; undefined where that step changed the count of Gaussians.
  gaussians<E> const& gradients() const {
    if constexpr (!Comm::alone) plans_.ranks.sum_arrived(gaussians_.gradients);
    return gaussians_.gradients;
  }

 private:
  // trainer_impl.hpp. `loss`: the caller's, or null.
  step_report step_by(loss_function<E> const* loss);
  template <class Plan>
  step_report step_on(Plan& plan, loss_function<E> const* loss);
  template <class Plan>
  void trace(Plan& plan, loss_function<E> const* loss, step_view& v, int image, int degree, step_report& report);
  template <class Plan>
  void optimize(Plan& plan, learning_rates const& rates, int degree);
  void make_room();
  bool in_ranks() const { return !Comm::alone && (comm_.size() > 1 || options_.batch > 1); }
  vec3 background_of(int step) const;
  bool shows_more() const {
    return std::any_of(parts_.begin(), parts_.end(), [](auto const& part) { return part->shows(); });
  }
  // The learned camera of a training view, and its image's size in a step.
  camera seen_by(std::size_t index) const {
    camera view = data_.train[index].view;
    for (auto const& part : parts_) view = part->view(index, view);
    return view;
  }
  step_view view_of(int before, int image);
  // The numbers that an image gives, and where those of part i begin.
  std::size_t numbers(std::size_t parts) const {
    std::size_t sum = 2;
    for (std::size_t i = 0; i < parts; ++i) sum += parts_[i]->numbers();
    return sum;
  }
  template <class T>
  span<T> numbers_of(span<T> row, std::size_t part) const {
    return row.subspan(numbers(part), parts_[part]->numbers());
  }

  // trainer_state_impl.hpp: this rank's part of values of all Gaussians, and the way back.
  static train_options const& checked(E& exec, Comm& comm, train_options const& options, dataset const& data,
                                      start_model const& start);
  static u64 total_of(Comm& comm, start_model const& start);
  decltype(auto) local_part(start_model const& start) {
    if constexpr (Comm::alone)
      return (start.rows);
    else
      return start.is_part ? start.rows : plans_.ranks.rows().local_part(start.rows);
  }
  training_state here() const;
  void take_up(training_state const& mine);
  gaussian_model gather_all(gaussian_model mine, int root = -1) const;

  struct no_ranks {
    no_ranks(E&, Comm const&, index_t) {}
  };
  struct plans {
    whole_view<E> whole;
    std::conditional_t<Comm::alone, no_ranks, rank_units<E, Comm, Traits, Tracer, Method::ordered>> ranks;
  };
  struct training_views {
    training_images<E> photos;
    view_order order;
    min_pixel_filter<E> filter;
  };
  struct tracing {
    frame_type frame;
    backward_passes<frame_type, Method> passes;
  };
  struct progress {
    int step = 0;
    std::size_t hit_buffer_bytes = 0;
    u64 sent = 0;
    training_hooks<E> hooks = {};
  };

  E& exec_;
  train_options options_;
  dataset const& data_;
  mutable Comm comm_;
  mutable plans plans_;
  mutable trained_gaussians<E> gaussians_;
  tracing tracing_;
  training_views views_;
  step_image<E> image_;
  dropout<E> dropout_;
  std::unique_ptr<densifier<E>> densifier_;
  learned_parts<frame_type> parts_;
  std::optional<finite_check<E>> finite_;  // where options.check_finite asks for it
  progress progress_;
};

/// A trainer; without a communicator, on one rank. An alias, since nvcc would copy a class's default argument to each
/// member template.
template <execution E, class Traits, class Tracer, gradient_method Method, class Comm = self_comm>
using trainer = basic_trainer<E, Traits, Tracer, Method, Comm>;

}}  // namespace gart::GART_ISA

#include <gart/train/trainer_impl.hpp>
#include <gart/train/trainer_state_impl.hpp>
