#pragma once
/// \file
/// Training behind one host-safe interface. The configuration (policy, SH degree, tracer, gradient method) is chosen
/// at run time from the compiled ones. Code that no device compiler sees, such as the `gart` program, uses it.
///
/// Errors: unsupported where no compiled configuration meets the request, naming what rules all out and how to compile
/// one. Also out_of_memory, and other errors of the policy.

#include <gart/exec/profile.hpp>
#include <gart/exposure/exposure_field.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/request.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>
#include <gart/train/start_model.hpp>
#include <gart/train/state.hpp>
#include <gart/train/step_report.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace gart {

/// A training run. On several ranks (configuration_request.ranks) all call the same members in the same order. Results
/// describe the whole run, and save() writes one file.
class session {
 public:
  /// Frees its memory of the policy.
  virtual ~session() = default;
  /// One step of training, and its report. A device may still be at the end of the step: what the policy queues, and
  /// all members here, come after that.
  virtual step_report step() = 0;
  /// Steps of this run, and of those that it resumes.
  virtual int steps_done() const = 0;
  /// Sets the run's length for rates, degrees and densification from the next step on, in place of options.iterations.
  /// A run that ends at a time does not know its steps beforehand. It is no part of the state: set it again after
  /// resuming.
  virtual void set_iterations(int iterations) = 0;
  /// The Gaussians, in host memory.
  virtual gaussian_model model() const = 0;
  /// The number of Gaussians.
  virtual u64 size() const = 0;
  /// Writes the Gaussians under a temporary name, then renames it. The ending says the format (io/splat_file.hpp). Of a
  /// splat PLY each rank writes its rows; for other formats rank 0 holds all. Errors: io_error, on all ranks.
  virtual void save_model(std::filesystem::path const& path, splat_traits const& traits = {}) const = 0;
  /// Renders a view to host memory.
  virtual rendered render(camera const& view, vec3 background) = 0;
  /// The view's colours in 8 bits a channel (renderer::render_8bit).
  virtual image8 render_8bit(camera const& view, vec3 background) = 0;
  /// Writes everything the next step depends on: parameters, Adam's moments, step, random state. It is written
  /// atomically. On the serial policy a resumed run has the bits of a run that never stopped.
  virtual void save(std::filesystem::path const& checkpoint) const = 0;
  /// Takes up a saved run. Errors: io_error for a checkpoint of another degree, a truncated or foreign file.
  virtual void load(std::filesystem::path const& checkpoint) = 0;
  /// The checkpoint's content in memory.
  virtual training_state state() const = 0;
  /// Takes up the run of a state. Errors: invalid_argument for a state of another degree.
  virtual void set_state(training_state const& state) = 0;

  /// The learned exposures of the training views and their lenses; empty where none are learned. The call render()
  /// shows the scene without them.
  virtual exposure_field exposures() const { return {}; }
  /// The learned cameras of the training views, in order; empty where neither poses nor lenses are learned.
  virtual std::vector<named_camera> poses() const { return {}; }
  /// A camera of the capture, at any pose, with its learned lens; unchanged where no lenses are learned.
  virtual camera as_learned(camera const& view) const { return view; }
  /// Times of stages; waits for the policy.
  virtual profiler& profile() = 0;
  /// Most bytes of the policy's memory that were in use at a time.
  virtual std::size_t peak_bytes() const = 0;
  virtual std::size_t hit_buffer_bytes() const = 0;  ///< of the last step; 0 where the method records nothing
  virtual u64 sent_bytes() const { return 0; }       ///< sent by this rank to others in its steps
  /// The configuration chosen for the request.
  virtual configuration_info configuration() const = 0;
};

/// The dataset must outlive the session. `start` seeds the Gaussians where given, else the dataset's points or random
/// ones. options.depth_weight asks for a configuration with depth. Errors: invalid_argument for
/// options.render.rebuild_every where the tracer builds no tree.
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, gaussian_model const* start = nullptr);
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const&& temporary, gaussian_model const* start = nullptr) = delete;
/// With several ranks `start` may hold each rank's rows alone.
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, start_model const& start);

}  // namespace gart
