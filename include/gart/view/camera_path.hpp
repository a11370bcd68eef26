#pragma once
/// \file
/// A smooth path of a camera through keyframes: what a viewer plays and `gart render` follows.
///
/// Between two keyframes lies a cubic Bezier curve whose speed at either end is that of a Catmull-Rom spline, by the
/// way to the keyframes on both sides: of positions, of rotations (the cumulative form of Kim, Kim and Shin, "A general
/// construction scheme for unit quaternion curves", 1995), of the logarithms of focal lengths, of principal points. The
/// path goes through every keyframe, and its speed has no jump there. The time between two keyframes is the square root
/// of the way between them, distance and angle (centripetal: close keyframes make no loops), so that no stretch is
/// without time; times that are given stand in its place. Size, model and lens are those of the first keyframe. In
/// double.
///
/// Errors: invalid_argument for less than two keyframes or frames, for keyframes of different camera models, and for
/// times that are not one a keyframe, from 0 on, each more than the one before.

#include <gart/scene/camera.hpp>

#include <vector>

namespace gart {

/// The path, by time.
class camera_path {
 public:
  /// Through these; a closed one goes on from the last to the first. `times` are those of the keyframes, with the end
  /// of a closed path behind them.
  explicit camera_path(std::vector<camera> keyframes, bool closed = false, std::vector<double> times = {});

  /// When it passes a keyframe; for their number, the end of a closed path.
  double time_of(std::size_t keyframe) const { return times_[keyframe]; }
  /// When it ends; it begins at 0.
  double end() const { return times_.back(); }
  /// The camera at a time from 0 to end().
  camera at(double time) const;

 private:
  std::vector<camera> keyframes_;
  std::vector<double> times_;
  bool closed_;
};

/// `frames` cameras along the path, evenly in time, the first and the last one at its ends; of a closed path the end is
/// left out, for it is the start.
std::vector<camera> smooth_path(std::vector<camera> const& keyframes, int frames, bool closed = false,
                                std::vector<double> const& times = {});

}  // namespace gart
