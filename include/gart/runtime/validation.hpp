#pragma once
/// \file
/// Options chosen by measurement before a run. Short trainings on small images use most training views, and the others
/// judge them. Test views are never seen.
///
/// The trials. One training view in 4, the third of each four, is held out. Noise falls with their number, and three
/// quarters of the views train well enough to compare. Images are shrunk, at most by 4 and to no less than 128 pixels,
/// and the largest number of Gaussians with them. The first trial has the caller's options, which should be the
/// usual ones. Each candidate changes one setting of these.
///
/// The verdict. Each held-out view gives the candidate's gain in PSNR over the first trial. The noise is the standard
/// error of their mean. A candidate is taken where its gain exceeds the noise and least_gain. Gains nearly add up
/// (bench/results/trial_candidates.json), so all such candidates are taken together. A claim would need twice the
/// noise; here a wrong choice mostly costs the same either way. Where it does not, a candidate asks for more or less
/// (bench/results/leave_one_out.json):
/// - Exposures are taken unless they lose more than twice the noise. A short trial visits each photograph too few times
///   for its twelve numbers to settle. The trials of bonsai and many_cameras lose 0.1 and 0.3 dB, and their runs gain
///   0.3 and 0.9 (bench/results/exposure_rates.json, chosen_full.json).
/// - Vignetting is taken by any gain above least_gain. Its nine numbers cost 0.3 dB at most, and a miss costs 0.8.
/// - Slow bands ask for twice the noise. They cost up to 1.3 dB, and gain on none of seven captures.
///
/// The length. Long runs overfit few photographs. So a third of the steps is tried last, with all that was taken,
/// against a trial three times as long. Small images overfit less than a run's. So a trial understates what fewer
/// steps gain, by 0.6 to 2 dB on six captures (bench/results/run_length.json). 1 dB is added, but not for renders.
///
/// Cost: about a tenth of a run's time (plan_validation), more where the run's own images are small. Trials have a
/// fixed number of steps: on the serial policy the choice does not depend on the machine's load. On a GPU the trials
/// run in parallel, one thread and stream each. With the caller's stream, or where memory ends, they run one after
/// another. Memory: the training views once more, shrunk, and a session for each running trial. With several ranks let
/// one rank measure and tell the others. Errors: as make_session.

#include <gart/io/dataset.hpp>
#include <gart/runtime/request.hpp>
#include <gart/train/options.hpp>

#include <functional>
#include <string>
#include <vector>

namespace gart {

struct capture_traits;

/// A setting to try in place of the usual one.
struct candidate {
  std::string setting;                       ///< the field of train_options that it sets: "exposure", "rates.sh_rest"
  std::string value;                         ///< in words, as `gart train` takes it
  std::function<void(train_options&)> take;  ///< sets it
  double least_noises = 1;                   ///< noises of its gain that the gain must exceed (trial::is_better)
  double understated = 0;                    ///< dB that a trial shows too little of its gain
  bool shortens = false;                     ///< it makes the run shorter: tried after the others
  std::string why = {};                      ///< why it asks for more or less than one noise, in words
};

/// The candidates that pay on some captures and cost on others, most useful first. Candidates without effect on this
/// capture are left out. Images of the whole sphere have no vignetting, and some budgets do not depend on pixels.
/// Those that shorten the run are last; a run that learns poses, lenses or depth has none.
std::vector<candidate> default_candidates(capture_traits const& traits, train_options const& options);

/// How candidates are tried.
struct validation_plan {
  std::vector<std::size_t> held_out = {};  ///< training views by index; empty: nothing is measured
  int shrink = 1;                          ///< pixels of a photograph to one of a trial's image, across and down
  int steps = 0;                           ///< of each trial; those that stand for a longer run have long_trial times
  std::size_t tried = 0;                   ///< candidates, the first of the list
  std::size_t trials = 0;                  ///< one for each of these, and one or two to compare them with
  bool beside = false;                     ///< in parallel, each on a stream of its own
  std::string why;                         ///< in words

  static constexpr int long_trial = 3;
};

/// A plan for the first of the candidates, those that shorten the run last. A short run tries fewer. A run that is too
/// short, or has too few training views, tries none. `beside`: trials may run in parallel.
validation_plan plan_validation(train_options const& options, dataset const& data,
                                std::vector<candidate> const& candidates, bool beside = false);

/// The result of a trial.
struct trial {
  std::string setting;   ///< the candidate's; empty: the options as they came
  std::string value;     ///< the candidate's
  double psnr = 0;       ///< dB, the mean of the views held out
  double gain = 0;       ///< dB, over the trial that it is compared with, the first or the long one
  double noise = 0;      ///< dB, the gain's standard error over the views held out
  bool taken = false;    ///< whether the options have it
  std::string why = {};  ///< the candidate's, where that settles the verdict

  static constexpr double least_gain = 0.05;  ///< dB: less is a tie
  /// Whether the gain, and what the trial understates of it, is above so many noises, and no tie. Below 0: whether it
  /// loses no more than that.
  bool is_better(double noises = 1, double understated = 0) const {
    double const whole = gain + understated;
    return whole > noises * noise && (noises < 0 || whole > least_gain);
  }
};

/// The result of all trials.
struct validation {
  validation_plan plan;       ///< how
  std::vector<trial> trials;  ///< the first, and one for each candidate
  train_options options;      ///< the options with the taken candidates
};

/// Called between steps, in the thread that called validate, with the share done, 0 to 1, and the plan in words.
/// Returning false ends the measurement; unfinished trials do not count.
using validation_progress = std::function<bool(double done, std::string const& plan)>;

/// Tries the candidates.
validation validate(configuration_request const& request, train_options const& options, dataset const& data,
                    std::vector<candidate> const& candidates, validation_progress const& progress = {});

/// The capture for trials: the training views, shrunk, and the same points. Of matched ones as many a pixel, so that a
/// trial has no more of a start than the run.
dataset shrunk(dataset const& data, int shrink);

}  // namespace gart
