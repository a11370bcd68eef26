#include <gart/core/error.hpp>
#include <gart/loss/metrics.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/runtime/degree_selection.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <utility>

namespace gart {

namespace {

constexpr int fewest_steps = 50;
constexpr std::size_t fewest_views = 20, least_held_out = 2, most_held_out = 8;

// The highest band that has a coefficient other than zero.
int degree_in_use(gaussian_model const& m) {
  int const all = sh_coefficients(m.sh_degree);
  int degree = 0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    float const* const row = m.sh.data() + i * 3 * static_cast<std::size_t>(all);
    for (int d = m.sh_degree; d > degree; --d) {
      if (std::any_of(row + 3 * sh_coefficients(d - 1), row + 3 * sh_coefficients(d), [](float c) { return c != 0; }))
        degree = d;
    }
  }
  return degree;
}

bool lower_configurations(configuration_request request) {
  try {
    while (request.sh_degree-- > 0) resolve(request);
    return true;
  } catch (unsupported const&) {
    return false;
  }
}

int trial_steps(int iterations) { return std::max(fewest_steps, iterations / 50); }
bool long_enough(trial_plan const& plan, int iterations) { return iterations >= 4 * plan.steps * plan.degree; }

struct running_trial {
  training_state start;                // where the branches parted
  std::optional<training_state> with;  // where the branch with the band ended
  std::vector<double> psnr_with;       // of each view held out
};

double mean(std::vector<double> const& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

class degree_selection final : public session {
 public:
  degree_selection(configuration_request const& request, train_options const& options, dataset const& data,
                   gaussian_model const& start, trial_plan const& plan)
      : request_(request),
        options_(options),
        data_(data),
        plan_(plan),
        gain_wanted_(options.sh_gain),
        every_(options.sh_every),
        interval_(sh_interval(plan.degree, options.sh_every, options.iterations)),
        start_degree_(std::min(degree_in_use(start), plan.degree)),
        never_trained_(options.held_out) {
    options_.sh_gain = 0;
    options_.sh_every = interval_;  // a configuration of a lower degree keeps to the schedule of all
    hold_out(true);
    open(with_sh_degree(start, stored_degree(0)));
  }

  step_report step() override {
    if (!settled_ && !trial_) arrange();
    inner_->profile().enable(profile_.enabled());
    step_report report = inner_->step();
    if (profile_.enabled()) profile_.take(inner_->profile());
    if (!trial_) return report;
    report.trial = true;
    if (inner_->steps_done() == trial_->start.step + plan_.steps) end_branch();
    report.step = steps_done();
    return report;
  }
  // Both branches of a trial keep to the schedules that it began with.
  void set_iterations(int iterations) override {
    if (trial_) return;
    options_.iterations = iterations;
    options_.sh_every = interval_ = sh_interval(plan_.degree, every_, iterations);
    plan_.begin = iterations / 2, plan_.steps = trial_steps(iterations);
    inner_->set_iterations(iterations);
  }
  int steps_done() const override { return trial_ ? trial_->start.step : inner_->steps_done(); }
  gaussian_model model() const override { return trial_ ? inner_->whole_of(trial_->start).scene : inner_->model(); }
  u64 size() const override { return trial_ ? begun_with_ : inner_->size(); }
  void save_model(std::filesystem::path const& path, splat_traits const& traits) const override {
    trial_ ? inner_->write_part(path, trial_->start.scene, traits) : inner_->save_model(path, traits);
  }
  rendered render(camera const& view, vec3 background) override { return inner_->render(view, background); }
  image8 render_8bit(camera const& view, vec3 background) override { return inner_->render_8bit(view, background); }
  void save(std::filesystem::path const& path) const override { inner_->write_part(path, part()); }
  void load(std::filesystem::path const& path) override { set_part(inner_->read_part(path)); }
  training_state state() const override { return inner_->whole_of(part()); }
  void set_state(training_state const& s) override { take_up(s, false); }
  training_state part() const override {
    training_state s = trial_ ? trial_->start : inner_->part();
    s.trials = trials_;
    return s;
  }
  void set_part(training_state const& mine) override { take_up(mine, true); }
  training_state whole_of(training_state const& mine) const override { return inner_->whole_of(mine); }
  void write_part(std::filesystem::path const& path, training_state const& mine) const override {
    inner_->write_part(path, mine);
  }
  void write_part(std::filesystem::path const& path, gaussian_model const& mine,
                  splat_traits const& traits) const override {
    inner_->write_part(path, mine, traits);
  }
  training_state read_part(std::filesystem::path const& path) const override { return inner_->read_part(path); }
  exposure_field exposures() const override { return inner_->exposures(); }
  std::vector<named_camera> poses() const override { return inner_->poses(); }
  camera as_learned(camera const& view) const override { return inner_->as_learned(view); }
  std::vector<band_trial> trials() const override { return trials_; }
  profiler& profile() override { return profile_; }
  std::size_t peak_bytes() const override { return std::max(peak_bytes_, inner_->peak_bytes()); }
  std::size_t lt_bytes() const override { return inner_->lt_bytes(); }
  configuration_info configuration() const override { return inner_->configuration(); }

 private:
  int first_step(int band) const { return band * interval_; }
  int stored_degree(int step) const {
    return std::max(start_degree_, sh_degree_at(step, plan_.degree, interval_, options_.iterations));
  }

  // `part`: of ranks each has its rows of it.
  void take_up(training_state const& s, bool part) {
    if (s.scene.sh_degree > plan_.degree)
      throw invalid_argument("the state is of SH degree " + std::to_string(s.scene.sh_degree) +
                             ", this run of at most " + std::to_string(plan_.degree));
    trial_.reset();
    trials_ = s.trials;
    settled_ = (!trials_.empty() && (trials_.back().kept() || trials_.back().band == 1)) ||
               (s.step >= plan_.begin && s.scene.sh_degree == 0);
    // The schedule of a run that was lengthened may ask for less than is stored: a band that was trained stays.
    start_degree_ = std::max(start_degree_, s.scene.sh_degree);
    hold_out(!settled_);
    open(s, part);
  }
  // Gives the next step the configuration it needs, or starts a trial.
  void arrange() {
    int const step = inner_->steps_done();
    int const degree = stored_degree(step);
    if (trials_.empty() && degree > inner_->configuration().sh_degree) {
      open(with_sh_degree(inner_->part(), degree));
    } else if (step >= plan_.begin && !long_enough(plan_, options_.iterations)) {
      settled_ = true;  // every band stays
      hold_out(false);
      open(inner_->part());
    } else if (step >= plan_.begin) {
      trial_.emplace();
      trial_->start = inner_->part(), begun_with_ = inner_->size();
    }
  }

  void end_branch() {
    std::vector<double> const psnr = held_out_psnr();
    training_state const& start = trial_->start;
    int const band = start.scene.sh_degree;
    if (!trial_->with) {
      trial_->psnr_with = psnr;
      trial_->with = inner_->part();
      open(with_sh_degree(start, band - 1));
      return;
    }
    band_trial result{band, start.step, mean(trial_->psnr_with), mean(psnr), 0, gain_wanted_};
    result.error = gain_error(trial_->psnr_with, psnr);
    result.forecast = forecast_gain(result.gain(), first_step(band), inner_->steps_done(), options_.iterations);
    trials_.push_back(result);
    settled_ = result.kept() || band == 1;
    if (settled_) {
      hold_out(false);
      open(result.kept() ? *trial_->with : inner_->part());
    }
    trial_.reset();
  }

  void hold_out(bool measured) {
    options_.held_out = never_trained_;
    if (measured) options_.held_out.insert(options_.held_out.end(), plan_.held_out.begin(), plan_.held_out.end());
  }

  std::vector<double> held_out_psnr() {
    vec3 const background(options_.background == background_kind::white ? 1.0f : 0.0f);
    exposure_field const exposures = inner_->exposures();
    std::vector<double> psnr;
    for (std::size_t const index : plan_.held_out) {
      dataset_view const& view = data_.train[index];
      image_float image = inner_->render(inner_->as_learned(view.view), background).color;
      apply(exposures.at(view.view), image);
      image_float const truth = composited(view.image, background);
      double const share = apply_mask(view.mask, truth, image);
      psnr.push_back(masked_psnr(image, truth, share));
    }
    return psnr;
  }

  // One session at a time: the old one's memory goes before the new one's comes.
  void open(start_model const& start) {
    close();
    request_.sh_degree = start.rows.sh_degree;
    inner_ = make_session(request_, options_, data_, start);
  }
  void open(training_state const& state, bool part = true) {
    open(start_model(state.scene, part));
    part ? inner_->set_part(state) : inner_->set_state(state);
  }
  void close() {
    if (!inner_) return;
    if (profile_.enabled()) profile_.take(inner_->profile());
    peak_bytes_ = std::max(peak_bytes_, inner_->peak_bytes());
    inner_.reset();
  }

  configuration_request request_;
  train_options options_;
  dataset const& data_;
  trial_plan plan_;
  double gain_wanted_;
  int every_, interval_, start_degree_;
  std::vector<std::size_t> never_trained_;
  bool settled_ = false;
  std::unique_ptr<session> inner_;
  std::optional<running_trial> trial_;
  std::vector<band_trial> trials_;
  profiler profile_;
  std::size_t peak_bytes_ = 0;
  u64 begun_with_ = 0;  // Gaussians of the trial that runs
};

}  // namespace

trial_plan plan_trials(configuration_request const& request, train_options const& options, std::size_t train_views) {
  trial_plan plan;
  plan.degree = request.sh_degree;
  plan.begin = options.iterations / 2;
  plan.steps = trial_steps(options.iterations);
  std::size_t const views = std::clamp(train_views / 20, least_held_out, most_held_out);
  if (plan.degree == 0) {
    plan.why = "there is no band to measure";
  } else if (!(options.sh_gain > 0)) {
    plan.why = "no gain is asked of a band";
  } else if (options.refine_poses) {
    plan.why = "poses are learned, and views held out would have none";
  } else if (train_views < fewest_views) {
    plan.why = std::to_string(train_views) + " training views are too few to hold some out and measure";
  } else if (!long_enough(plan, options.iterations)) {
    plan.why = "a run under " + std::to_string(4 * plan.steps * plan.degree) + " steps is too short to measure";
  } else if (!lower_configurations(request)) {
    plan.why = "lower degrees are not compiled for this configuration";
  } else {
    for (std::size_t i = 0; i < views; ++i) plan.held_out.push_back((2 * i + 1) * train_views / (2 * views));
    char gain[32];
    std::snprintf(gain, sizeof gain, "%g", static_cast<double>(options.sh_gain));
    plan.why = std::string("a band that buys less than ") + gain + " dB on " + std::to_string(views) +
               " views held out goes; measured from step " + std::to_string(plan.begin);
  }
  return plan;
}

double gain_error(std::vector<double> const& with, std::vector<double> const& without) {
  double const gain = mean(with) - mean(without), n = static_cast<double>(with.size());
  double squares = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    double const off = with[i] - without[i] - gain;
    squares += off * off;
  }
  return std::sqrt(squares / (n - 1) / n);
}

double forecast_gain(double gain, int first_step, int now, int iterations) {
  return gain * (iterations - first_step) / (now - first_step);
}

std::unique_ptr<session> make_degree_selection(configuration_request const& request, train_options const& options,
                                               dataset const& data, gaussian_model const& start,
                                               trial_plan const& plan) {
  return std::make_unique<degree_selection>(request, options, data, start, plan);
}

}  // namespace gart
