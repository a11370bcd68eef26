#pragma once
/// \file
/// What a capture asks for, measured before a run: short trainings on small images of a share of the training views,
/// judged by the views held out of them. No threshold of a statistic of the capture decides, and test views are never
/// seen.
///
/// The trials. One training view in 4 is held out, from the middle of each four on: noise falls with their number, and
/// three quarters of the views train well enough to compare. Images are shrunk, at most by 4 and to no less than 128
/// pixels, and the Gaussians that there may be with them. The first trial is of the options as they come, which should
/// be the literature's. Each candidate is tried on these options with one setting changed.
///
/// The verdict. Each held-out view gives a gain in PSNR, of the candidate over the first trial. The noise is the
/// standard error of their mean. A candidate is taken where its gain is above the noise and above least_gain; a tie
/// leaves the value that was. Gains add up nearly (bench/results/trial_candidates.json), so those taken are taken
/// together. Twice the noise would be the test of a claim: here both errors cost alike.
///
/// Cost: trials have a fixed number of steps, so that the same capture and options give the same choice on the serial
/// policy whatever the machine's load: together about a tenth of a run's time (plan_validation), more where the run's
/// own images are small. On a GPU the trials run beside each other, one thread and stream each; with a stream of the
/// caller's, or where memory ends, in turn. Memory: the training views once more, shrunk, and a session for each trial
/// that runs. Ranks are left out: let one rank measure and tell the others. Errors: as make_session.

#include <gart/io/dataset.hpp>
#include <gart/runtime/request.hpp>
#include <gart/train/options.hpp>

#include <functional>
#include <string>
#include <vector>

namespace gart {

struct capture_traits;

/// A setting that training may have in place of the literature's.
struct candidate {
  std::string setting;                       ///< the field of train_options that it sets: "exposure", "rates.sh_rest"
  std::string value;                         ///< in words, as `gart train` takes it
  std::function<void(train_options&)> take;  ///< sets it
};

/// Those that pay on some captures and cost on others, the first where a run is too short for all; none that changes
/// nothing: images of the whole sphere have no corners for vignetting, and some budgets do not depend on pixels.
std::vector<candidate> usual_candidates(capture_traits const& traits, train_options const& options);

/// How candidates are tried.
struct validation_plan {
  std::vector<std::size_t> held_out = {};  ///< training views by index; empty: nothing is measured
  int shrink = 1;                          ///< pixels of a photograph to one of a trial's image, across and down
  int steps = 0;                           ///< of each trial
  std::size_t trials = 0;                  ///< the first, of the options as they come, and one for each candidate
  bool beside = false;                     ///< all at once, each on a stream of its own
  std::string why;                         ///< in words
};

/// For so many candidates at most: fewer where the run is too short for all of them, none where it is too short for
/// one, or has too few training views to hold some out. `beside`: they may run beside each other.
validation_plan plan_validation(train_options const& options, dataset const& data, std::size_t candidates,
                                bool beside = false);

/// What a trial gave.
struct trial {
  std::string setting;  ///< the candidate's; empty: the options as they came
  std::string value;    ///< the candidate's
  double psnr = 0;      ///< dB, the mean of the views held out
  double gain = 0;      ///< dB, over the first trial
  double noise = 0;     ///< dB, the gain's standard error over the views held out
  bool taken = false;   ///< whether the options have it

  static constexpr double least_gain = 0.05;  ///< dB: less is a tie
  /// Whether the gain is above its noise, and no tie.
  bool is_better() const { return gain > least_gain && gain > noise; }
};

/// What was measured, and what came of it.
struct validation {
  validation_plan plan;       ///< how
  std::vector<trial> trials;  ///< in order
  train_options options;      ///< with the candidates that were taken
};

/// Called between steps, by the thread that called validate: how much is done, 0 to 1, and the plan in words. False
/// ends it: trials that were not finished count for nothing.
using validation_progress = std::function<bool(double done, std::string const& plan)>;

/// Tries the candidates.
validation validate(configuration_request const& request, train_options const& options, dataset const& data,
                    std::vector<candidate> const& candidates, validation_progress const& progress = {});

/// The capture as its trials see it: the training views alone, shrunk, and the same points.
dataset shrunk(dataset const& data, int shrink);

}  // namespace gart
