#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/session.hpp>
#include <gart/runtime/validation.hpp>
#include <gart/train/densify/error_growth.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <future>
#include <limits>
#include <memory>

namespace gart {

namespace {

constexpr std::size_t views_for_one = 4, fewest_held_out = 3;
constexpr int least_pixels = 128, most_shrink = 4;
constexpr int fewest_steps = 700, most_steps = 2000;
// A trial's step on shrunk images takes about this share of a run's step. Images have a quarter of the pixels or less,
// but kernels cost as much to start.
constexpr double step_share = 0.4, run_share = 0.1;
// Adam's rate of exposures in a trial, at most. A trial visits a view a few times, where whole steps overshoot.
constexpr float trial_exposure_rate = 0.015f;
// Small images leave a GPU idle between kernels. Trials beside each other fill it: each adds about this share of the
// time that it takes alone.
constexpr double beside_share = 0.5;

// The shorter side of the smallest training image.
int smallest_side(dataset const& data) {
  int least = std::numeric_limits<int>::max();
  for (dataset_view const& v : data.train) least = std::min({least, v.view.width, v.view.height});
  return least;
}

bool divides(dataset const& data, int shrink) {
  return std::all_of(data.train.begin(), data.train.end(), [&](dataset_view const& v) {
    return v.view.kind != camera_kind::equirectangular || (v.view.width % shrink == 0 && v.view.height % shrink == 0);
  });
}

std::vector<double> psnr_of(session& training, dataset const& data, validation_plan const& plan,
                            background_kind background) {
  vec3 const behind(background == background_kind::white ? 1.0f : 0.0f);
  some_views views;
  for (std::size_t const i : plan.held_out) views.push_back(&data.train[i]);
  scores const result = evaluate(views, behind, training.exposures(),
                                 [&](camera const& c) { return training.render(training.as_learned(c), behind); });
  std::vector<double> psnr;
  for (view_score const& v : result.views) psnr.push_back(v.psnr);
  return psnr;
}

double mean(std::vector<double> const& values) {
  double sum = 0;
  for (double const v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

double standard_error(std::vector<double> const& values) {
  double const n = static_cast<double>(values.size()), middle = mean(values);
  double squares = 0;
  for (double const v : values) squares += (v - middle) * (v - middle);
  return std::sqrt(squares / (n - 1) / n);
}

// Where one trial throws, the others end.
struct end_all_on_failure {
  std::atomic<bool>& ended;
  int before = std::uncaught_exceptions();
  ~end_all_on_failure() {
    if (std::uncaught_exceptions() > before) ended = true;
  }
};

// Calls run(i, go_on) for each trial, in turn or in parallel threads. A call of go_on() counts a step, and returns
// false once `progress` has ended the measurement.
template <class Run>
void run_trials(validation_plan const& plan, validation_progress const& progress, Run run) {
  double const all = static_cast<double>(plan.trials) * (plan.steps + 1);
  std::atomic<int> asked{0};
  std::atomic<bool> ended{false};
  auto const report = [&] {
    if (progress && !progress(std::min(asked / all, 1.0), plan.why)) ended = true;
  };
  if (!plan.beside) {
    for (std::size_t i = 0; i < plan.trials; ++i) {
      run(i, [&] {
        ++asked, report();
        return !ended;
      });
    }
    return;
  }
  std::vector<std::future<void>> trials;
  for (std::size_t i = 0; i < plan.trials; ++i) {
    trials.push_back(std::async(std::launch::async, [&, i] {
      end_all_on_failure const guard{ended};
      run(i, [&] {
        ++asked;
        return !ended;
      });
    }));
  }
  end_all_on_failure const guard{ended};
  for (std::future<void>& t : trials)
    while (t.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) report();
  for (std::future<void>& t : trials) t.get();  // throws the error of a trial
}

// A trial's options: as many Gaussians a pixel as in the run, and all counts of steps shortened alike. Short runs raise
// the rate of the bands above the first like those of geometry (optim/schedule.hpp). They raise it at most to the first
// band's. Otherwise a fast rate would seem to pay. A step has one view, without learned poses or depth. Held-out views
// have no learned pose, and shrunk ones no depth map.
train_options of_trial(train_options options, validation_plan const& plan) {
  int const area = plan.shrink * plan.shrink;
  double const shorter = static_cast<double>(plan.steps) / options.iterations;
  auto const sooner = [&](int& steps) {
    if (steps > 0) steps = std::max(1, static_cast<int>(std::lround(steps * shorter)));
  };
  options.held_out.insert(options.held_out.end(), plan.held_out.begin(), plan.held_out.end());
  options.iterations = plan.steps, options.batch = 1;
  options.refine_poses = options.refine_lens = false, options.depth_weight = 0;
  options.max_gaussians = std::max<index_t>(options.max_gaussians / static_cast<index_t>(area), 1);
  options.error.min_gaussians = options.error.min_gaussians / area;
  options.random_points = std::min(options.random_points, options.max_gaussians);
  sooner(options.adc.opacity_reset_every);
  options.rates.exposure = std::min(options.rates.exposure, trial_exposure_rate);
  float& rest = options.rates.sh_rest;
  rest = std::max(rest, std::min(rest / static_cast<float>(std::sqrt(shorter)), options.rates.sh_dc));
  for (int* from : {&options.error.from, &options.mcmc.from, &options.adc.from})
    *from = std::min(*from, plan.steps / 20);
  for (int* every : {&options.error.every, &options.mcmc.every, &options.adc.every})
    if (*every > 0) *every = std::clamp(plan.steps / 40, 1, *every);
  return options;
}

}  // namespace

std::vector<candidate> default_candidates(capture_traits const& traits, train_options const& options) {
  std::vector<candidate> all;
  all.push_back({"exposure", "on", [](train_options& o) { o.exposure = true; }, -2});
  if (!traits.panoramas) all.push_back({"vignetting", "on", [](train_options& o) { o.vignetting = true; }});
  all.push_back({"rates.sh_rest", "0.000125", [](train_options& o) { o.rates.sh_rest = 0.000125f; }});
  error_growth_options more = options.error;
  more.pixels_per_gaussian = 100;
  index_t const most = options.max_gaussians;
  if (options.densify == densify_kind::error &&
      growth_budget(more, most, traits.pixels) > growth_budget(options.error, most, traits.pixels))
    all.push_back({"error.pixels_per_gaussian", "100", [](train_options& o) { o.error.pixels_per_gaussian = 100; }});
  return all;
}

dataset shrunk(dataset const& data, int shrink) {
  dataset small;
  small.format = data.format, small.split = data.split, small.points = data.points;
  small.extent = data.extent, small.alpha = data.alpha;
  small.origin = data.origin, small.bounds_min = data.bounds_min, small.bounds_max = data.bounds_max;
  small.train.resize(data.train.size());
#if defined(_OPENMP)
#pragma omp parallel for schedule(dynamic)
#endif
  for (std::size_t i = 0; i < data.train.size(); ++i) {
    dataset_view const& v = data.train[i];
    small.train[i] = {v.name, downscaled(v.view, shrink, v.name), box_downscale(v.image, shrink),
                      v.mask.empty() ? image8() : box_downscale(v.mask, shrink), image_float()};
  }
  return small;
}

validation_plan plan_validation(train_options const& options, dataset const& data, std::size_t candidates,
                                bool beside) {
  validation_plan plan;
  std::size_t const views = data.train.size(), held_out = views / views_for_one;
  if (views > 0) plan.shrink = std::clamp(smallest_side(data) / least_pixels, 1, most_shrink);
  while (!divides(data, plan.shrink)) --plan.shrink;
  double const steps = run_share / (plan.shrink > 1 ? step_share : 1) * options.iterations;
  double const each = beside ? beside_share : 1;  // of the time of a trial alone
  plan.trials = std::min(candidates + 1, static_cast<std::size_t>(steps / fewest_steps / each));
  if (candidates == 0) {
    plan.why = "every setting is given";
  } else if (held_out < fewest_held_out) {
    plan.why = std::to_string(views) + " training views are too few to hold some out";
  } else if (plan.trials < 2) {
    plan.why = "a run of " + std::to_string(options.iterations) + " steps is too short to try anything";
  } else {
    plan.beside = beside;
    for (std::size_t i = 0; i < held_out; ++i) plan.held_out.push_back(i * views_for_one + views_for_one / 2);
    plan.steps =
        std::clamp(static_cast<int>(steps / each / static_cast<double>(plan.trials)), fewest_steps, most_steps);
    plan.why = std::to_string(plan.trials) + " trials of " + std::to_string(plan.steps) + " steps, judged by " +
               std::to_string(held_out) + " training views held out";
    if (plan.trials <= candidates)
      plan.why += "; the run is too short for " + std::to_string(candidates + 1 - plan.trials) + " more";
  }
  if (plan.held_out.empty()) plan.trials = 0;
  return plan;
}

validation validate(configuration_request const& request, train_options const& options, dataset const& data,
                    std::vector<candidate> const& candidates, validation_progress const& progress) {
  bool const beside = !request.stream && resolve(request).backend == backend_kind::cuda;
  validation result{plan_validation(options, data, candidates.size(), beside), {}, options};
  validation_plan const& plan = result.plan;
  if (plan.held_out.empty()) return result;
  dataset const small = shrunk(data, plan.shrink);
  configuration_request alone = request;
  alone.ranks = nullptr, alone.depth = false;
  std::vector<std::vector<double>> psnr(plan.trials);  // of each view held out; none where a trial was ended
  auto const run = [&](std::size_t i, auto const& go_on) {
    train_options changed = options;
    if (i > 0) candidates[i - 1].take(changed);
    std::unique_ptr<session> const training = make_session(alone, of_trial(changed, plan), small);
    while (go_on() && training->steps_done() < plan.steps) training->step();
    if (training->steps_done() == plan.steps) psnr[i] = psnr_of(*training, small, plan, options.background);
  };
  try {
    run_trials(plan, progress, run);
  } catch (out_of_memory const&) {
    if (!plan.beside) throw;
    result.plan.beside = false;  // one at a time may have room
    psnr.assign(plan.trials, {});
    run_trials(plan, progress, run);
  }
  for (std::size_t i = 0; i < plan.trials && !psnr[0].empty(); ++i) {
    if (psnr[i].empty()) continue;
    trial tried;
    tried.psnr = mean(psnr[i]), tried.taken = i == 0;
    if (i > 0) {
      candidate const& c = candidates[i - 1];
      tried.setting = c.setting, tried.value = c.value;
      std::vector<double> gains;
      for (std::size_t v = 0; v < psnr[i].size(); ++v) gains.push_back(psnr[i][v] - psnr[0][v]);
      tried.gain = mean(gains), tried.noise = standard_error(gains);
      tried.taken = tried.is_better(c.least_noises);
      if (tried.taken) c.take(result.options);
    }
    result.trials.push_back(tried);
  }
  return result;
}

}  // namespace gart
