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
#include <gart/render/frame.hpp>
#include <gart/render/render_image.hpp>
#include <gart/scene/traits.hpp>
#include <gart/train/options.hpp>
#include <gart/train/state.hpp>
#include <gart/train/step_report.hpp>
#include <gart/train/training_images.hpp>
#include <gart/train/view_order.hpp>

#include <optional>

#include <gart/math/sh.hpp>
#include <cstdlib>
#include <cstring>

namespace gart::inline GART_ISA {
namespace detail {
inline char const* try_text() { char const* t = std::getenv("GART_TRY"); return t ? t : ""; }
inline bool trying(char const* what) { return std::strstr(try_text(), what) != nullptr; }
inline float try_value(char const* what, float otherwise) {
  char const* at = std::strstr(try_text(), what);
  return at && at[std::strlen(what)] == '=' ? static_cast<float>(std::atof(at + std::strlen(what) + 1)) : otherwise;
}
GART_HD inline void center_direction(float const* m, vec3d const& p, float (&d)[3], float& inverse) {
  double x = m[0] - p.x, y = m[1] - p.y, z = m[2] - p.z;
  double n = sqrt(x * x + y * y + z * z);
  n = n > 1e-12 ? n : 1e-12;
  d[0] = float(x / n), d[1] = float(y / n), d[2] = float(z / n), inverse = float(1 / n);
}
struct center_color_kernel {
  gaussians_view<float const> scene;
  vec3d position;
  int bands;
  float* out;
  GART_KERNEL void operator()(index_t i) const {
    float d[3], inverse;
    center_direction(scene.mean + std::size_t{3} * i, position, d, inverse);
    sh_basis<3> const y(vec3(d[0], d[1], d[2]));
    int const stride = scene.sh_stride();
    float const* c = scene.sh + static_cast<std::size_t>(stride) * i;
    float* o = out + static_cast<std::size_t>(stride) * i;
    int const n = bands < stride / 3 ? bands : stride / 3;
    for (int k = 0; k < 3; ++k) {
      float sum = 0;
      for (int b = 0; b < n; ++b) sum += y.y[b] * c[3 * b + k];
      o[k] = sum / y.y[0];
    }
  }
};
struct center_expand_kernel {
  gaussians_view<float const> scene;
  vec3d position;
  int bands;
  gaussians_view<float> gradient;
  GART_KERNEL void operator()(index_t i) const {
    float d[3], inverse;
    center_direction(scene.mean + std::size_t{3} * i, position, d, inverse);
    sh_basis<3> const basis(vec3(d[0], d[1], d[2]));
    float const x = d[0], y = d[1], z = d[2], xx = x * x, yy = y * y, zz = z * z;
    int const stride = scene.sh_stride();
    float const* c = scene.sh + static_cast<std::size_t>(stride) * i;
    float* g = gradient.sh + static_cast<std::size_t>(stride) * i;
    float const r[3] = {g[0] / basis.y[0], g[1] / basis.y[0], g[2] / basis.y[0]};
    if (r[0] == 0 && r[1] == 0 && r[2] == 0) return;
    float const a1 = 0.4886025119029199f, a2 = 1.0925484305920792f, a6 = 0.31539156525252005f, a8 = 0.5462742152960396f;
    float const b9 = -0.5900435899266435f, b10 = 2.890611442640554f, b11 = -0.4570457994644658f, b12 = 0.3731763325901154f,
                b14 = 1.445305721320277f;
    float const j[16][3] = {{0, 0, 0}, {0, -a1, 0}, {0, 0, a1}, {-a1, 0, 0},
      {a2 * y, a2 * x, 0}, {0, -a2 * z, -a2 * y}, {-2 * a6 * x, -2 * a6 * y, 4 * a6 * z}, {-a2 * z, 0, -a2 * x}, {2 * a8 * x, -2 * a8 * y, 0},
      {b9 * 6 * x * y, b9 * 3 * (xx - yy), 0}, {b10 * y * z, b10 * x * z, b10 * x * y},
      {b11 * -2 * x * y, b11 * (4 * zz - xx - 3 * yy), b11 * 8 * y * z},
      {b12 * -6 * x * z, b12 * -6 * y * z, b12 * (6 * zz - 3 * xx - 3 * yy)},
      {b11 * (4 * zz - 3 * xx - yy), b11 * -2 * x * y, b11 * 8 * x * z},
      {b14 * 2 * x * z, b14 * -2 * y * z, b14 * (xx - yy)}, {b9 * 3 * (xx - yy), b9 * -6 * x * y, 0}};
    int const n = bands < stride / 3 ? bands : stride / 3;
    float gd[3] = {0, 0, 0};
    for (int b = 0; b < n; ++b) {
      float const s = c[3 * b] * r[0] + c[3 * b + 1] * r[1] + c[3 * b + 2] * r[2];
      for (int k = 0; k < 3; ++k) gd[k] += s * j[b][k], g[3 * b + k] = basis.y[b] * r[k];
    }
    float const along = gd[0] * x + gd[1] * y + gd[2] * z;
    for (int k = 0; k < 3; ++k) gradient.mean[std::size_t{3} * i + k] += (gd[k] - along * d[k]) * inverse;
  }
};
}  // namespace detail


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
  exposure_field exposures() const;  ///< of the views that were trained on; empty where none are learned
  std::size_t lt_bytes() const { return lt_bytes_; }  ///< of the last step
  /// The Gaussians, in the policy's memory.
  gaussians<E>& scene() { return scene_; }
  /// Of the last step, in their shape.
  gaussians<E> const& gradients() const { return gradients_; }

 private:
  using frame_type = frame<E, Traits, Tracer>;

  template <class Pass, class Loss>
  void differentiate_by(Pass& pass, Loss&& loss, std::size_t view, learning_rates const& rates);
  void update(dataset_view const& view, learning_rates const& rates, int degree, span<float const> moments);
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
  buffer<float, E> center_;
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
  std::optional<finite_check<E>> finite_;          // where options.check_finite asks for it
  index_t started_with_ = 0;                       // Gaussians
  int step_ = 0;
  float growth_ = 1;
  std::size_t lt_bytes_ = 0;
};

}  // namespace gart::inline GART_ISA

#include <gart/train/trainer_impl.hpp>
