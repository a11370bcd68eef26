#pragma once
/// \file
/// Training behind one host-safe interface: the configuration (policy, SH degree, tracer, backward strategy) is chosen
/// at run time from those that were compiled. What g++ code, the `gart` program for one, uses.
///
/// Errors: unsupported, naming the configurations there are and how to compile one, for a configuration that is not;
/// out_of_memory; whatever the policy throws.

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

/// A training run. On several ranks (configuration_request.ranks) all call the same members, in the same order; what is
/// said of the run is of all, and save() writes one file.
class session {
 public:
  /// The policy's memory goes with it.
  virtual ~session() = default;
  /// One step of training, and what it says of itself.
  virtual step_report step() = 0;
  /// Of this run and, where it was resumed, of those before.
  virtual int steps_done() const = 0;
  /// The length of the run that rates, degrees and densification go by from the next step on, in place of
  /// options.iterations: for a run that ends at a time, whose number of steps is not known beforehand. No part of the
  /// state: whoever resumes sets it again.
  virtual void set_iterations(int iterations) = 0;
  /// The Gaussians, in host memory.
  virtual gaussian_model model() const = 0;
  /// How many there are.
  virtual u64 size() const = 0;
  /// Writes them to a temporary name, then renames it, in the format that the ending says (io/splat_file.hpp). Ranks
  /// write their rows each of a splat PLY; of another format rank 0 has to hold all. Errors: io_error, on all ranks.
  virtual void save_model(std::filesystem::path const& path, splat_traits const& traits = {}) const = 0;
  /// A view of the Gaussians to host memory.
  virtual rendered render(camera const& view, vec3 background) = 0;
  /// Its colours alone, in 8 bits a channel, as renderer has it.
  virtual image8 render_8bit(camera const& view, vec3 background) = 0;
  /// Everything the next step depends on: parameters, Adam's moments, step, random state. Written atomically; resuming
  /// gives the same bits as not having stopped, on the serial policy. load throws io_error for a checkpoint of another
  /// degree, a truncated or foreign file.
  virtual void save(std::filesystem::path const& checkpoint) const = 0;
  /// Takes up the run that was saved.
  virtual void load(std::filesystem::path const& checkpoint) = 0;
  /// The same in memory. set_state throws invalid_argument for a state of another degree.
  virtual training_state state() const = 0;
  /// Takes up the run that the state is of.
  virtual void set_state(training_state const& state) = 0;

  /// Of the training views so far and their lenses; empty where none are learned. render() shows the scene's own
  /// colours.
  virtual exposure_field exposures() const { return {}; }
  /// The cameras of the training views as they are learned, in order; empty where neither poses nor lenses are.
  virtual std::vector<named_camera> poses() const { return {}; }
  /// A camera of the capture, at whatever pose, with its lens as it is learned; as it is where none are.
  virtual camera as_learned(camera const& view) const { return view; }
  /// Times of stages; waits for the policy.
  virtual profiler& profile() = 0;
  /// Most bytes of the policy's memory that were in use at a time.
  virtual std::size_t peak_bytes() const = 0;
  virtual std::size_t lt_bytes() const = 0;     ///< of the last step; 0 where the strategy records nothing
  virtual u64 sent_bytes() const { return 0; }  ///< that this rank has sent to others in its steps
  /// What was chosen for the request.
  virtual configuration_info configuration() const = 0;
};

/// The dataset must outlive the session. `start` seeds the Gaussians where given, else the dataset's points or random
/// ones. options.depth_weight asks for a configuration with depth. Errors: invalid_argument for
/// options.render.rebuild_every where the tracer builds no tree.
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, gaussian_model const* start = nullptr);
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const&& temporary, gaussian_model const* start = nullptr) = delete;
/// Of several ranks `start` may have each rank's rows alone.
std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, start_model const& start);

}  // namespace gart
