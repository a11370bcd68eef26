#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/optim/error_growth.hpp>
#include <gart/runtime/choose.hpp>
#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/session.hpp>
#include <gart/runtime/validation.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace gart {

namespace {

constexpr std::size_t views_for_one = 8, fewest_held_out = 3;
constexpr int least_pixels = 128, most_shrink = 4;
constexpr int fewest_steps = 750, most_steps = 2000;
// A step of a trial takes about this share of the time of one of the run, where its images are smaller: they have a
// quarter of the pixels or less, but starting the kernels costs as much.
constexpr double step_share = 0.4, run_share = 0.1;

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

// What the run's options are in a trial: as many Gaussians a pixel, and all that is counted in steps as much sooner. A
// slow rate of the bands above the first would not get as far as in the run, and a fast one would seem to pay: it is
// raised as those of the geometry are in short runs (optim/schedule.hpp), at most to that of the first band. One view a
// step, by its photograph and the capture's pose: views held out have no pose learned, and small ones no depth map.
train_options of_trial(train_options options, validation_plan const& plan) {
  int const area = plan.shrink * plan.shrink;
  double const shorter = static_cast<double>(plan.steps) / options.iterations;
  auto const sooner = [&](int& steps) { steps = std::max(1, static_cast<int>(std::lround(steps * shorter))); };
  options.held_out.insert(options.held_out.end(), plan.held_out.begin(), plan.held_out.end());
  options.iterations = plan.steps, options.batch = 1;
  options.refine_poses = options.refine_lens = false, options.depth_weight = 0;
  options.max_gaussians = std::max<index_t>(options.max_gaussians / static_cast<index_t>(area), 1);
  options.error.least_budget = options.error.least_budget / area;
  options.random_points = std::min(options.random_points, options.max_gaussians);
  sooner(options.adc.opacity_reset_every);
  float& rest = options.rates.sh_rest;
  rest = std::max(rest, std::min(rest / static_cast<float>(std::sqrt(shorter)), options.rates.sh_dc));
  for (int* from : {&options.error.from, &options.mcmc.from, &options.adc.from})
    *from = std::min(*from, plan.steps / 20);
  for (int* every : {&options.error.every, &options.mcmc.every, &options.adc.every})
    *every = std::clamp(plan.steps / 40, 1, *every);
  return options;
}

}  // namespace

std::vector<candidate> usual_candidates(capture_traits const& traits) {
  std::vector<candidate> all;
  all.push_back({"exposure", "on", [](train_options& o) { o.exposure = true; }});
  if (!traits.panoramas) all.push_back({"vignetting", "on", [](train_options& o) { o.vignetting = true; }});
  all.push_back({"rates.sh_rest", "0.0025", [](train_options& o) { o.rates.sh_rest = 0.0025f; }});
  return all;
}

dataset shrunk(dataset const& data, int shrink) {
  dataset small;
  small.format = data.format, small.split = data.split, small.points = data.points;
  small.extent = data.extent, small.alpha = data.alpha;
  small.origin = data.origin, small.bounds_min = data.bounds_min, small.bounds_max = data.bounds_max;
  small.train.resize(data.train.size());
#pragma omp parallel for schedule(dynamic)
  for (std::size_t i = 0; i < data.train.size(); ++i) {
    dataset_view const& v = data.train[i];
    small.train[i] = {v.name, downscaled(v.view, shrink, v.name), box_downscale(v.image, shrink),
                      v.mask.empty() ? image8() : box_downscale(v.mask, shrink), image_float()};
  }
  return small;
}

validation_plan plan_validation(train_options const& options, dataset const& data, std::size_t candidates) {
  validation_plan plan;
  std::size_t const views = data.train.size(), held_out = views / views_for_one;
  if (views > 0) plan.shrink = std::clamp(smallest_side(data) / least_pixels, 1, most_shrink);
  while (!divides(data, plan.shrink)) --plan.shrink;
  double const steps = run_share / (plan.shrink > 1 ? step_share : 1) * options.iterations;
  plan.trials = std::min(candidates + 1, static_cast<std::size_t>(steps / fewest_steps));
  if (candidates == 0) {
    plan.why = "every setting is given";
  } else if (held_out < fewest_held_out) {
    plan.why = std::to_string(views) + " training views are too few to hold some out";
  } else if (plan.trials < 2) {
    plan.why = "a run of " + std::to_string(options.iterations) + " steps is too short to try anything";
  } else {
    for (std::size_t i = 0; i < held_out; ++i) plan.held_out.push_back(i * views_for_one + views_for_one / 2);
    plan.steps = std::clamp(static_cast<int>(steps / static_cast<double>(plan.trials)), fewest_steps, most_steps);
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
  validation result{plan_validation(options, data, candidates.size()), {}, options};
  validation_plan const& plan = result.plan;
  if (plan.held_out.empty()) return result;
  dataset const small = shrunk(data, plan.shrink);
  configuration_request alone = request;
  alone.ranks = nullptr, alone.depth = false;
  std::vector<double> best;  // PSNR of each view held out
  for (std::size_t i = 0; i < plan.trials; ++i) {
    train_options changed = result.options;
    trial tried;
    if (i > 0) {
      candidate const& c = candidates[i - 1];
      tried.setting = c.setting, tried.value = c.value;
      c.take(changed);
    }
    std::unique_ptr<session> const training = make_session(alone, of_trial(changed, plan), small);
    while (training->steps_done() < plan.steps) {
      double const done = static_cast<double>(training->steps_done()) / plan.steps;
      double const of_all = (static_cast<double>(i) + done) / static_cast<double>(plan.trials);
      if (progress && !progress(of_all, i > 0 ? tried.setting + " " + tried.value : "the usual")) return result;
      training->step();
    }
    std::vector<double> const psnr = psnr_of(*training, small, plan, options.background);
    tried.psnr = mean(psnr), tried.taken = i == 0;
    if (i > 0) {
      std::vector<double> gains;
      for (std::size_t v = 0; v < psnr.size(); ++v) gains.push_back(psnr[v] - best[v]);
      tried.gain = mean(gains);
      double squares = 0;
      for (double const g : gains) squares += (g - tried.gain) * (g - tried.gain);
      double const n = static_cast<double>(gains.size());
      tried.noise = std::sqrt(squares / (n - 1) / n);
      tried.taken = tried.is_better();
    }
    if (tried.taken) best = psnr, result.options = changed;
    result.trials.push_back(tried);
  }
  return result;
}

}  // namespace gart
