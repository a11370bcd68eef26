#include "choices.hpp"
#include "training_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gart_cli {

namespace {

// Timing each launch slows a step a little: one step in so many is timed.
constexpr int profile_every = 16;

// For several ranks: the steps a second of the slowest and the fastest, and their memory.
std::string in_ranks(recent_steps const& recent, std::size_t peak_bytes) {
  if (ranks::size() == 1) return {};
  struct rank_state {
    double rate, bytes;
  };
  auto const all = ranks::of_all(rank_state{recent.own > 0 ? 1 / recent.own : 0, static_cast<double>(peak_bytes)});
  auto const from_to = [&](double rank_state::*value, auto const& told) {
    auto const [least, most] =
        std::minmax_element(all.begin(), all.end(), [&](auto const& a, auto const& b) { return a.*value < b.*value; });
    std::string const low = told((*least).*value), high = told((*most).*value);
    return low == high ? high : low + " to " + high;
  };
  return "  " + std::to_string(all.size()) +
         " ranks: " + from_to(&rank_state::rate, [](double rate) { return fixed(rate, rate < 10 ? 2 : 0); }) +
         " steps/s, " + from_to(&rank_state::bytes, as_bytes) + " each";
}

}  // namespace

bool training_run::train(interrupt_guard const& interrupt) {
  recent_steps recent;
  stopwatch since_start;
  double last_checkpoint = 0;
  for (;;) {
    int const before = session_->steps_done(), length = a_.length(before, course_.seconds);
    if (before >= length) return true;
    // The first steps load images and are no measure of the others.
    session_->set_iterations(before < 100 ? a_.options.iterations : length);
    double const done_before = progress_at(before);
    if (ranks::agreed(interrupt.wanted()) || (a_.stop_at > 0 && before >= a_.stop_at)) return false;
    session_->profile().enable(before % profile_every == profile_every - 1);
    stopwatch const step;
    gart::step_report const report = checked_step();
    double const own = step.seconds(), seconds = ranks::agreed(own);
    if (session_->profile().enabled()) ++profiled_steps_, profiled_seconds_ += seconds;
    session_->profile().enable(false);
    if (report.backward != configuration_.backward && !fell_back_) {
      fell_back_ = true;
      say_.note("step " + with_commas(report.step) +
                ": the hit buffer would pass --hit-memory or its 2^32 slots, this step and others like it are " +
                report.backward);
    }
    if (!std::isfinite(report.loss)) {
      throw gart::error("step " + std::to_string(report.step) + ", view " + report.view +
                        ": the loss is not a number (the last checkpoint is whole: " + a_.checkpoint_file().string() +
                        ")");
    }
    finite_steps_ += a_.options.check_finite, skipped_updates_ += report.skipped;
    ++steps_, step_seconds_ += seconds, course_.seconds += seconds, gaussians_ = report.gaussians;
    course_.add(report);
    recent.add(report, seconds, own);
    show(report, recent);
    double const done = progress_at(report.step);
    auto const passes = [&](int parts) { return std::floor(done * parts) > std::floor(done_before * parts); };
    bool const by_time = a_.time_budget > 0;
    if (by_time && passes(200)) course_.close_point();
    int const between = a_.steps_between_tests();
    bool const due = by_time && a_.eval_every < 0
                         ? passes(5)
                         : between > 0 && report.step / between != (report.step - a_.options.batch) / between;
    if (due && report.step < a_.length(report.step, course_.seconds)) {
      gart::scores const scores = test(report.step);
      show_curve();
      if (view_) view_->set_scores(data_, scores);
    }
    double const elapsed = a_.checkpoint_minutes > 0 ? ranks::agreed(since_start.seconds()) : 0;
    if (a_.checkpoint_minutes > 0 && elapsed - last_checkpoint > 60 * a_.checkpoint_minutes) {
      stopwatch const saving;
      save_checkpoint();
      save_seconds_ += saving.seconds();
      last_checkpoint = elapsed;
    }
    if (view_ && !view_->idle() && !attend(interrupt, seconds, report, recent)) return false;
  }
}

void training_run::serve() {
  if (!a_.viewed) return;
  view_ = std::make_unique<training_view>(a_, *session_, data_, eval_background_);
  say_.clear();
  say_addresses(view_->server(), a_.view, stdout);
  show_curve();
}

bool training_run::attend(interrupt_guard const& interrupt, double seconds, gart::step_report const& report,
                          recent_steps const& recent) {
  gart::view_status status;
  status.step = report.step, status.of = a_.options.iterations, status.loss = recent.loss;
  status.gaussians = report.gaussians, status.seconds = course_.seconds;
  status.steps_per_second = recent.seconds > 0 ? 1 / recent.seconds : 0;
  return view_->attend(seconds, status, interrupt, [this] {
    stopwatch const saving;
    save_checkpoint();
    save_seconds_ += saving.seconds();
    say_.note("saved " + a_.checkpoint_file().string() + ", as a viewer asked");
    return a_.checkpoint_file().string();
  });
}

void training_run::show_curve() {
  if (!view_) return;
  gart::view_curve curve;
  for (auto const& p : course_.train) curve.loss.emplace_back(p.step, p.loss);
  for (auto const& p : course_.test) curve.test.emplace_back(p.step, p.psnr);
  view_->set_curve(curve);
}

// A run that ends at a time has a point for each two hundredth of the time.
history training_run::course_of(train_arguments const& a) {
  return history(a.time_budget > 0 ? std::numeric_limits<int>::max() : a.options.iterations);
}

gart::step_report training_run::checked_step() {
  try {
    return session_->step();
  } catch (gart::not_finite const& e) {
    throw gart::error(std::string(e.what()) + "; the last checkpoint is whole: " + a_.checkpoint_file().string());
  }
}

void training_run::show(gart::step_report const& report, recent_steps const& recent) {
  double const share = progress_at(report.step);
  if (!ranks::agreed(say_.due(share))) return;
  double const rate = recent.seconds > 0 ? 1 / recent.seconds : 0;
  double const left = (a_.options.iterations - report.step) * recent.seconds;
  say_.state(with_commas(report.step) + (a_.time_budget > 0 ? "" : "/" + with_commas(a_.options.iterations)) + "  " +
                 fixed(rate, rate < 10 ? 2 : 0) + " it/s  loss " + fixed(recent.loss, 4) + "  PSNR " +
                 fixed(recent.psnr, 2) + " dB  " + with_commas(report.gaussians) + " Gaussians  " +
                 as_duration(a_.time_budget > 0 ? std::clamp(a_.time_budget - course_.seconds, 0.0, left) : left) +
                 " left" + in_ranks(recent, session_->peak_bytes()),
             share);
}

}  // namespace gart_cli
