#pragma once
// Training and rendering behind one host-safe interface: the row (policy, SH degree, tracer, backward strategy) is
// chosen at run time from the rows that were compiled. What g++ code, the `gart` program for one, uses.
//
// Errors: unsupported, naming the rows there are, for a row that is not; out_of_memory; whatever the policy throws.

#include <gart/exec/profile.hpp>
#include <gart/io/dataset.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>
#include <gart/train/state.hpp>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace gart {

// Names as on the command line. "auto": the best there is on this machine.
struct row_request {
  std::string backend = "auto";   // auto serial openmp cuda
  std::string tracer = "auto";    // auto bvh embree
  std::string backward = "auto";  // auto pixel hybrid primitive
  int sh_degree = 3;
};

struct row_info {
  std::string backend, tracer, backward;
  int sh_degree = 3;
};

// A request with every "auto" decided; unsupported, naming the rows, where there is none.
row_info resolve(row_request const& request);
std::vector<row_info> compiled_rows();

struct rendered {
  image_float color;          // background composited
  image_float transmittance;  // 1 channel
  image_float depth;          // 1 channel: sum of weight * t
  basic_image<u32> hits;      // 1 channel: hits composited
};

class renderer {
 public:
  virtual ~renderer() = default;
  virtual void set_model(gaussian_model const& model) = 0;
  virtual rendered render(camera const& view, render_options const& options) = 0;
  virtual profiler& profile() = 0;
  virtual std::size_t peak_bytes() const = 0;
  virtual row_info row() const = 0;
};

std::unique_ptr<renderer> make_renderer(row_request const& request);

struct step_report {
  int step = 0;  // steps done, this one included
  float loss = 0;
  float psnr = 0;  // of this step's training view
  index_t gaussians = 0;
  std::string view;
  std::string backward;  // the strategy of this step: not the one asked for where its LT buffer would pass the budget
  bool trial = false;    // a step of a trial (train/degree_selection.hpp): `step` stands still until it is decided
};

class session {
 public:
  virtual ~session() = default;
  virtual step_report step() = 0;
  virtual int steps_done() const = 0;
  virtual gaussian_model model() const = 0;
  virtual rendered render(camera const& view, vec3 background) = 0;
  // Everything the next step depends on: parameters, Adam's moments, step, random state. Written atomically; resuming
  // gives the same bits as not having stopped, on the serial policy. load throws io_error for a checkpoint of another
  // degree, a truncated or foreign file.
  virtual void save(std::filesystem::path const& checkpoint) const = 0;
  virtual void load(std::filesystem::path const& checkpoint) = 0;
  // The same in memory. set_state throws invalid_argument for a state of another degree.
  virtual training_state state() const = 0;
  virtual void set_state(training_state const& state) = 0;
  virtual std::vector<band_trial> trials() const { return {}; }  // that are over
  virtual profiler& profile() = 0;
  virtual std::size_t peak_bytes() const = 0;
  virtual std::size_t lt_bytes() const = 0;  // of the last step; 0 where the strategy records nothing
  virtual row_info row() const = 0;
};

// The dataset must outlive the session. `start` seeds the Gaussians where given, else the dataset's points or random
// ones. With options.sh_gain the session measures which bands of spherical harmonics to store, and its row and degree
// change in its course (train/degree_selection.hpp).
std::unique_ptr<session> make_session(row_request const& request, train_options const& options, dataset const& data,
                                      gaussian_model const* start = nullptr);

}  // namespace gart
