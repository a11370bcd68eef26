#pragma once
/// \file
/// Limits the size of views, so that they arrive in time. It also limits the time that they take from a training. Pure
/// functions of measured times: no clock, no threads.

#include <gart/core/isa.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// Sizes of views that are rendered within a time, by the milliseconds a pixel that the last ones took. A view's fixed
/// cost counts as a cost of its pixels. So sizes shrink until the time is met, and stay there.
class frame_pacing {
 public:
  /// A view of so many pixels took so long.
  void measured(double milliseconds, double pixels) {
    if (!(milliseconds > 0) || !(pixels > 0)) return;
    double const now = milliseconds / pixels;
    rate_ = rate_ > 0 ? 0.5 * (rate_ + now) : now;
  }
  /// Milliseconds a pixel; 0 where nothing was measured.
  double rate() const { return rate_; }
  /// Takes another's measure where there is none of its own.
  void start_from(frame_pacing const& other) {
    if (!(rate_ > 0)) rate_ = other.rate_;
  }

  /// The size, in the full size's shape, that takes about so many milliseconds. It is at most the full size, at least
  /// an eighth of its sides. Sides are whole parts in 32 of the full ones, so that a size does not change with every
  /// view. With nothing measured it is a quarter of the sides.
  std::pair<int, int> size(int full_width, int full_height, double milliseconds) const {
    double const pixels = static_cast<double>(full_width) * full_height;
    double const wanted = rate_ > 0 ? std::sqrt(milliseconds / (rate_ * pixels)) : 0.25;
    int const parts = std::clamp(static_cast<int>(32 * std::min(wanted, 1.0)), 4, 32);
    return {std::max(1, full_width * parts / 32), std::max(1, full_height * parts / 32)};
  }

 private:
  double rate_ = 0;
};

/// Limits views to a share of a training's time: work earns time, each view spends it. Saved time is bounded, so a late
/// viewer does not stop the training. A step after a view starts with cold caches and an idle device; its extra time
/// counts as the view's.
class time_share {
 public:
  /// Between 0 and 1 of the training's own time; 1: as much as is wanted.
  explicit time_share(double share) { set(share); }
  /// The same, from here on.
  void set(double share) { share_ = std::clamp(share, 0.0, 1.0); }
  /// The share, 0 to 1.
  double share() const { return share_; }
  /// So many seconds went into a step of the training.
  void worked(double seconds) {
    double own = seconds;
    if (after_view_ && mean_step_ > 0)
      own = std::min(seconds, mean_step_);
    else
      mean_step_ += (seconds - mean_step_) * (mean_step_ > 0 ? mean_weight : 1);
    after_view_ = false;
    saved_ = std::min(saved_ + own * share_, saved_most) - (seconds - own);
  }
  /// So many seconds went into a view, or into asking whether one is wanted.
  void viewed(double seconds, bool rendered = true) { saved_ -= seconds, after_view_ = rendered; }
  /// Whether a view may be rendered now. What it takes beyond what was saved is earned before the next one.
  bool may_view() const { return saved_ > 0 || share_ >= 1; }

 private:
  static constexpr double saved_most = 0.1;    // seconds
  static constexpr double mean_weight = 0.05;  // of a step, in the mean
  double share_ = 0, saved_ = 0;
  double mean_step_ = 0;  // seconds of a step that no view came before
  bool after_view_ = false;
};

}}  // namespace gart::GART_ISA
