#pragma once
/// \file
/// Which bands of spherical harmonics a scene pays for, measured while it trains. Bands that buy nothing are not
/// stored: the run ends in the configuration of a lower degree, whose parameters, gradients, Adam's moments, checkpoint
/// and PLY have no floats for them (11 + 3 (degree + 1)^2 a Gaussian: 14, 23, 38 or 59).
///
/// The course. Storage follows the schedule of degrees (optim/schedule.hpp): a band gets memory at the step it is first
/// used in, which changes no bit of the training. A few training views, evenly spread, are held out. From half the run
/// on the highest band is on trial: it goes or stays, and where it went the next one is tried. Then the views that were
/// held out join the training.
///
/// A trial is a branching. From one state (parameters, moments, step) `steps` steps are trained with the band and as
/// many without, on the same views, random numbers and rates, and the mean PSNR of the held-out views is compared where
/// both end. The winner's steps are the run's, the loser's are the price: 2% of the run a trial, at most three.
/// - Not before against after a band is switched on: everything else is trained meanwhile, and gains more than the
/// band. Not with the coefficients against with zeros in their place: the others have arranged themselves around
/// them, and a band that only shifts what the constant term could as well say would seem to pay.
/// - The branch without starts behind, by just that, and is not always level when it ends: what is left over counts for
/// the band. The error is on the side of keeping.
/// - The gain now is not the gain in the end. Adam moves a coefficient by about its rate a step, so the band's share of
/// what it will come to rises at first as the steps it has had and then levels off, and with it the gain. Hence
/// forecast = gain (iterations - first) / (now - first), first the step the band was first used in: an upper bound
/// for a gain of that course; the band stays if forecast >= sh_gain. A gain that is not positive has no future. (It
/// also covers the others' errors shrinking, against which the same share weighs more in dB.)
/// - A few views may differ by more than a band is worth: where a part of the scene is seen by few cameras, chance
/// alone sets two branches a dB apart in a view. The standard error of the gain over the views says so; where it is
/// over 0.05 dB, and over sh_gain, nothing can be told and the band stays.
///
/// Per Gaussian degrees are not chosen: rows of one length keep loads aligned and the kernels' loops straight.
///
/// A checkpoint in the middle of a trial is the state in which the branches parted, and resuming tries again: the same
/// bits on the serial policy. Cost: the trials, a second state in host memory while they run, a new session at each
/// change of degree. Errors: as make_session.

#include <gart/runtime/session.hpp>

#include <string>
#include <vector>

namespace gart {

/// When bands are tried, and on what.
struct trial_plan {
  int degree = 0;                     ///< the most that is stored
  int begin = 0;                      ///< step of the first trial
  int steps = 0;                      ///< of a branch
  std::vector<std::size_t> held_out;  ///< training views by index; empty: nothing is measured, every band is stored
  std::string why;                    ///< in words
};

/// Nothing is measured where the trials would take more than a quarter of the run, where fewer than 20 training views
/// are there to hold some out of, or where the configuration is not compiled for every lower degree.
trial_plan plan_trials(configuration_request const& request, train_options const& options, std::size_t train_views);

/// Standard error of the mean gain, from the PSNR of each view held out, of at least two.
double gain_error(std::vector<double> const& with, std::vector<double> const& without);
/// The gain, in dB, to be expected after `iterations` steps of a band used from first_step on, of the gain at step
/// `now`.
double forecast_gain(double gain, int first_step, int now, int iterations);

/// What make_session returns where plan_trials finds something to measure.
std::unique_ptr<session> make_degree_selection(configuration_request const& request, train_options const& options,
                                               dataset const& data, gaussian_model const& start,
                                               trial_plan const& plan);

}  // namespace gart
