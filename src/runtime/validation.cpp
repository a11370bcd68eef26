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
// dB. The squared error of rounding to 8 bits alone has 58.9. A blank photograph has infinitely many.
constexpr double most_psnr = 59;
constexpr int fewest_steps = 700, most_steps = 2000;
// A trial's step on shrunk images takes about this share of a run's step. Images have a quarter of the pixels or less,
// but kernels cost as much to start.
constexpr double step_share = 0.4, run_share = 0.1;
// Adam's rate of exposures in a trial, at most. A trial visits a view a few times, where whole steps overshoot.
constexpr float trial_exposure_rate = 0.015f;
// dB of the gain of fewer steps, which small images of photographs show too little. Renders agree, and overfit little
// at any size.
constexpr double trial_understates = 1;
constexpr char const* understated = "a trial shows it worse than a whole run";
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
  for (view_score const& v : result.views)
    if (!std::isnan(v.psnr)) psnr.push_back(std::min(v.psnr, most_psnr));  // shrinking a mask may leave nothing
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

// What is told of all trials: the share of their steps that is done.
struct trial_progress {
  validation_progress const& tell;
  std::string const& why;
  double all;  // steps
  std::atomic<int> asked{0};
  std::atomic<bool> ended{false};

  void report() {
    if (tell && !tell(std::min(asked / all, 1.0), why)) ended = true;
  }
};

// Each n-th point.
point_cloud thinned(point_cloud const& all, std::size_t n) {
  point_cloud some;
  for (std::size_t i = 0; i < all.size(); i += n) {
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      some.position.push_back(all.position[k]), some.color.push_back(all.color[k]);
  }
  return some;
}

// Calls run(i, go_on) for each of `count` trials, in turn or in parallel threads. A call of go_on() counts a step, and
// returns false once the caller has ended the measurement.
template <class Run>
void run_trials(std::size_t count, bool beside, trial_progress& progress, Run run) {
  if (!beside) {
    for (std::size_t i = 0; i < count; ++i) {
      run(i, [&] {
        ++progress.asked, progress.report();
        return !progress.ended;
      });
    }
    return;
  }
  std::vector<std::future<void>> trials;
  for (std::size_t i = 0; i < count; ++i) {
    trials.push_back(std::async(std::launch::async, [&, i] {
      end_all_on_failure const guard{progress.ended};
      run(i, [&] {
        ++progress.asked;
        return !progress.ended;
      });
    }));
  }
  end_all_on_failure const guard{progress.ended};
  for (std::future<void>& t : trials)
    while (t.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) progress.report();
  for (std::future<void>& t : trials) t.get();  // throws the error of a trial
}

// A trial's options: as many Gaussians a pixel as in the run, and all counts of steps `shorter` alike. Short runs raise
// the rate of the bands above the first like those of geometry (optim/schedule.hpp). They raise it at most to the first
// band's. Otherwise a fast rate would seem to pay. A step has one view, without learned poses or depth. Held-out views
// have no learned pose, and shrunk ones no depth map.
train_options of_trial(train_options options, validation_plan const& plan, double shorter) {
  int const area = plan.shrink * plan.shrink;
  auto const sooner = [&](int& steps) {
    if (steps > 0) steps = std::max(1, static_cast<int>(std::lround(steps * shorter)));
  };
  options.held_out.insert(options.held_out.end(), plan.held_out.begin(), plan.held_out.end());
  sooner(options.iterations), options.batch = 1;
  options.refine_poses = options.refine_lens = false, options.depth_weight = 0;
  options.max_gaussians = std::max<index_t>(options.max_gaussians / static_cast<index_t>(area), 1);
  options.error.min_gaussians = options.error.min_gaussians / area;
  options.random_points = std::min(options.random_points, options.max_gaussians);
  sooner(options.adc.opacity_reset_every);
  options.rates.exposure = std::min(options.rates.exposure, trial_exposure_rate);
  float& rest = options.rates.sh_rest;
  rest = std::max(rest, std::min(rest / static_cast<float>(std::sqrt(shorter)), options.rates.sh_dc));
  for (int* from : {&options.error.from, &options.mcmc.from, &options.adc.from})
    *from = std::min(*from, options.iterations / 20);
  for (int* every : {&options.error.every, &options.mcmc.every, &options.adc.every})
    if (*every > 0) *every = std::clamp(options.iterations / 40, 1, *every);
  return options;
}

// Trials of plan.steps that candidates take: one each, and one or two to compare them with. Those that shorten the run
// are compared with a long one.
int cost_of(std::vector<candidate> const& candidates, std::size_t tried) {
  int usual = 0, shorter = 0;
  for (std::size_t i = 0; i < tried; ++i) ++(candidates[i].shortens ? shorter : usual);
  return usual + (usual > 0) + shorter + (shorter > 0 ? validation_plan::long_trial : 0);
}

// The trials of some candidates against the options that were taken so far, and their verdicts.
class trial_round {
 public:
  trial_round(configuration_request const& request, dataset const& small, trial_progress& progress, validation& result)
      : request_(request), small_(small), progress_(progress), result_(result) {}

  // `candidates`: not empty. `shorter`: than the run, all counts of steps of the trial that these are compared with.
  void run(std::vector<candidate> const& candidates, double shorter) {
    std::vector<train_options> trials{of_trial(result_.options, result_.plan, shorter)};
    for (candidate const& c : candidates) {
      train_options changed = result_.options;
      c.take(changed);
      trials.push_back(of_trial(changed, result_.plan, shorter));
    }
    std::vector<std::vector<double>> const psnr = psnr_of_all(trials);
    if (psnr[0].size() < 2) return;  // no noise can be told
    if (result_.trials.empty()) result_.trials.push_back({"", "", mean(psnr[0]), 0, 0, true});
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (!psnr[i + 1].empty()) judge(candidates[i], psnr[i + 1], psnr[0]);
  }

 private:
  // Of each view held out; none where a trial was ended.
  std::vector<std::vector<double>> psnr_of_all(std::vector<train_options> const& trials) {
    std::vector<std::vector<double>> psnr(trials.size());
    auto const run = [&](std::size_t i, auto const& go_on) {
      std::unique_ptr<session> const training = make_session(request_, trials[i], small_);
      while (go_on() && training->steps_done() < trials[i].iterations) training->step();
      if (training->steps_done() == trials[i].iterations)
        psnr[i] = psnr_of(*training, small_, result_.plan, result_.options.background);
    };
    try {
      run_trials(trials.size(), result_.plan.beside, progress_, run);
    } catch (out_of_memory const&) {
      if (!result_.plan.beside) throw;
      result_.plan.beside = false;  // one at a time may have room
      progress_.ended = false;
      psnr.assign(trials.size(), {});
      run_trials(trials.size(), false, progress_, run);
    }
    return psnr;
  }

  void judge(candidate const& c, std::vector<double> const& psnr, std::vector<double> const& without) {
    std::vector<double> gains;
    for (std::size_t v = 0; v < psnr.size(); ++v) gains.push_back(psnr[v] - without[v]);
    trial tried{c.setting, c.value, mean(psnr), mean(gains), standard_error(gains)};
    tried.taken = tried.is_better(c.least_noises, c.understated);
    if (tried.taken != tried.is_better()) tried.why = c.why;
    if (tried.taken) c.take(result_.options);
    result_.trials.push_back(tried);
  }

  configuration_request const& request_;
  dataset const& small_;
  trial_progress& progress_;
  validation& result_;
};

}  // namespace

std::vector<candidate> default_candidates(capture_traits const& traits, train_options const& options) {
  std::vector<candidate> all;
  all.push_back({.setting = "exposure",
                 .value = "on",
                 .take = [](train_options& o) { o.exposure = true; },
                 .least_noises = -2,
                 .why = understated});
  if (traits.matched > 0 && !options.match) all.push_back({"match", "on", [](train_options& o) { o.match = true; }});
  if (!traits.panoramas) {
    all.push_back({.setting = "vignetting",
                   .value = "on",
                   .take = [](train_options& o) { o.vignetting = true; },
                   .least_noises = 0,
                   .why = "a wrong choice costs less than a missed one"});
  }
  error_growth_options more = options.error;
  more.pixels_per_gaussian = 100;
  index_t const most = options.max_gaussians;
  if (options.densify == densify_kind::error &&
      growth_budget(more, most, traits.pixels) > growth_budget(options.error, most, traits.pixels))
    all.push_back({"error.pixels_per_gaussian", "100", [](train_options& o) { o.error.pixels_per_gaussian = 100; }});
  all.push_back({.setting = "rates.sh_rest",
                 .value = "0.000125",
                 .take = [](train_options& o) { o.rates.sh_rest = 0.000125f; },
                 .least_noises = 2,
                 .why = "it has to gain twice that: a wrong choice costs most"});
  // Poses, lenses and depth take steps too, and trials have none of them.
  if (options.refine_poses || options.refine_lens || options.depth_weight > 0) return all;
  int const third = options.iterations / validation_plan::long_trial;
  bool const rendered = traits.clear_border;
  all.push_back({.setting = "iterations",
                 .value = std::to_string(third),
                 .take = [third](train_options& o) { o.iterations = third; },
                 .understated = rendered ? 0 : trial_understates,
                 .shortens = true,
                 .why = rendered ? "" : understated});
  return all;
}

dataset shrunk(dataset const& data, int shrink) {
  for (dataset_view const& v : data.train) downscaled(v.view, shrink, v.name);  // throws; no parallel loop may
  dataset small;
  small.format = data.format, small.split = data.split, small.points = data.points, small.mirrors = data.mirrors;
  small.matched = thinned(data.matched, static_cast<std::size_t>(shrink * shrink));
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

validation_plan plan_validation(train_options const& options, dataset const& data,
                                std::vector<candidate> const& candidates, bool beside) {
  validation_plan plan;
  std::size_t const views = data.train.size(), held_out = views / views_for_one;
  if (views > 0) plan.shrink = std::clamp(smallest_side(data) / least_pixels, 1, most_shrink);
  while (!divides(data, plan.shrink)) --plan.shrink;
  double const share = run_share / (plan.shrink > 1 ? step_share : 1), each = beside ? beside_share : 1;
  double const steps = share / each * options.iterations;  // of all trials
  std::size_t tried = candidates.size();
  while (tried > 0 && cost_of(candidates, tried) * fewest_steps > steps) --tried;
  if (candidates.empty()) {
    plan.why = "every setting is given";
  } else if (held_out < fewest_held_out) {
    plan.why = std::to_string(views) + " training views are too few to hold some out";
  } else if (tried == 0) {
    plan.why = "a run of " + std::to_string(options.iterations) + " steps is too short to try anything";
  } else {
    int const cost = cost_of(candidates, tried);
    auto const end = candidates.begin() + static_cast<std::ptrdiff_t>(tried);
    auto const shorter =
        static_cast<std::size_t>(std::count_if(candidates.begin(), end, [](candidate const& c) { return c.shortens; }));
    plan.beside = beside, plan.tried = tried;
    plan.trials = tried + (tried > shorter) + (shorter > 0);
    for (std::size_t i = 0; i < held_out; ++i) plan.held_out.push_back(i * views_for_one + views_for_one / 2);
    plan.steps = std::clamp(static_cast<int>(steps / cost), fewest_steps, most_steps);
    plan.why =
        std::to_string(plan.trials) + " trials of " + std::to_string(plan.steps) + " steps" +
        (shorter > 0 ? ", one of them of " + std::to_string(validation_plan::long_trial) + " times as many" : "") +
        ", judged by " + std::to_string(held_out) + " training views held out";
    if (tried < candidates.size())
      plan.why += "; the run is too short for " + std::to_string(candidates.size() - tried) + " more";
  }
  return plan;
}

validation validate(configuration_request const& request, train_options const& options, dataset const& data,
                    std::vector<candidate> const& candidates, validation_progress const& progress) {
  bool const beside = !request.stream && resolve(request).backend == backend_kind::cuda;
  validation result{plan_validation(options, data, candidates, beside), {}, options};
  validation_plan const& plan = result.plan;
  if (plan.held_out.empty()) return result;
  dataset const small = shrunk(data, plan.shrink);
  configuration_request alone = request;
  alone.ranks = nullptr, alone.depth = false;
  double const steps = static_cast<double>(plan.steps) * cost_of(candidates, plan.tried);
  trial_progress told{progress, plan.why, steps + static_cast<double>(plan.trials)};
  trial_round round(alone, small, told, result);
  std::vector<candidate> usual, shortening;
  for (std::size_t i = 0; i < plan.tried; ++i) (candidates[i].shortens ? shortening : usual).push_back(candidates[i]);
  double const shorter = static_cast<double>(plan.steps) / options.iterations;
  if (!usual.empty()) round.run(usual, shorter);
  if (!shortening.empty() && !told.ended) round.run(shortening, validation_plan::long_trial * shorter);
  return result;
}

}  // namespace gart
