#pragma once
/// \file
/// A smooth path of a camera through keyframes: what a viewer plays and `gart render` follows.
///
/// Between two keyframes lies a cubic Bezier curve with the end speeds of a Catmull-Rom spline. It is a curve of
/// positions, of rotations, of logarithms of focal lengths and of principal points. Rotations use the cumulative form
/// of Kim, Kim and Shin, "A general construction scheme for unit quaternion curves", 1995. The path goes through every
/// keyframe, and its speed has no jump there. The time between two keyframes is the square root of their distance and
/// angle (centripetal: close keyframes make no loops). Given times take its place. Size, model and lens are those of
/// the first keyframe. In double.
///
/// Errors: invalid_argument for less than two keyframes or frames, for keyframes of different camera models, and for
/// wrong times. There must be one a keyframe, from 0 on, each more than the one before.

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

/// `frames` cameras along the path, evenly in time, with both ends. A closed path leaves out its end, which is the
/// start.
std::vector<camera> smooth_path(std::vector<camera> const& keyframes, int frames, bool closed = false,
                                std::vector<double> const& times = {});

}  // namespace gart
