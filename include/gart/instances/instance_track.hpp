#pragma once
/// \file
/// Instances that move: a pose between two, and a track of poses at times. Rays see them as they stand at each ray's
/// own time (actors/actor_tracer.hpp). As one scene for every tracer (instances/instance_set.hpp) they are traced in
/// slices of time (rays/lidar.hpp, rays_during). An actor is off by half its way during a slice, at most.
///
/// Errors: require_track throws invalid_argument, naming the track, the field and the remedy.

#include <gart/instances/require_instances.hpp>
#include <gart/math/turn.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// The way from one pose to another: the position in a line, the rotation by the shortest turn, both evenly.
struct track_step {
  mat3d rotation{1.0};             ///< where it begins
  vec3d position{0.0};             ///< the same
  vec3d way{0.0}, turn{0.0};       ///< from there to its end, in the world
  double begin = 0, duration = 1;  ///< times; read by whom has a time

  /// From the pose to itself.
  track_step() = default;
  /// Of two poses.
  track_step(instance const& from, instance const& to)
      : rotation(from.rotation),
        position(from.position),
        way(to.position - from.position),
        turn(angles_of(to.rotation * glm::transpose(from.rotation))) {}

  /// The rotation at f, from 0 at the beginning to 1 at the end.
  GART_HD mat3d rotation_at(double f) const { return turn_of(turn * f) * rotation; }
  /// The position there.
  GART_HD vec3d position_at(double f) const { return position + way * f; }

  /// From dL/dw of a small turn of the pose at f to that of the pose at the end. The one at the beginning has the rest.
  /// With the turn's axis u and angle a, a turn b of the end is B b at f. Along u it is f times itself. Across u it is
  /// (e^(i f a) - 1) / (e^(i a) - 1) times itself. That is a turn about u by (f - 1) a / 2 and a change of length. This
  /// is B's transpose.
  GART_HD vec3d pull_back_to_end(double f, vec3d const& by_turn) const {
    double const angle = glm::length(turn);
    if (!(angle > 1e-9)) return by_turn * f;
    vec3d const axis = turn / angle, along = axis * glm::dot(axis, by_turn);
    double const half = 0.5 * angle, back = (1 - f) * half, ratio = sin(f * half) / sin(half);
    return along * f + turned_about<double>(axis, sin(back), cos(back), by_turn - along) * ratio;
  }
};

/// The pose at `time` on the way from one (0) to another (1). Model and scale are the first one's. Times beyond go on
/// alike.
inline instance between(instance const& from, instance const& to, double time) {
  track_step const step(from, to);
  instance out = from;
  out.position = step.position_at(time), out.rotation = step.rotation_at(time);
  return out;
}

/// An instance at a pose of its own at each time from the first key to the last. It is of one model and scale. One key:
/// it stands at that pose at all times.
struct instance_track {
  std::vector<double> times;    ///< [keys], ascending, in the unit of the rays' times
  std::vector<instance> poses;  ///< [keys]

  /// Nothing.
  instance_track() = default;
  /// That stands.
  explicit instance_track(instance const& pose) : times{0}, poses{pose} {}
  /// That moves.
  instance_track(std::vector<double> at, std::vector<instance> keys) : times(std::move(at)), poses(std::move(keys)) {}

  /// Whether it has poses of several times.
  bool moves() const { return poses.size() > 1; }
  /// Its ways from key to key, one at least.
  std::vector<track_step> steps() const {
    std::vector<track_step> out;
    for (std::size_t k = 0; k < poses.size() && (k == 0 || k + 1 < poses.size()); ++k) {
      std::size_t const next = k + 1 < poses.size() ? k + 1 : k;
      instance from = poses[k], to = poses[next];
      for (instance* const each : {&from, &to}) each->rotation = rotation_of(quaternion_of(each->rotation));
      out.emplace_back(from, to);
      out.back().begin = times[k];
      if (next > k) out.back().duration = times[next] - times[k];
    }
    return out;
  }
};

/// Throws invalid_argument for what is no track of one of so many models; `name` is how the caller calls it.
inline void require_track(instance_track const& track, std::size_t models, std::string const& name) {
  if (track.poses.empty()) throw invalid_argument(name + ".poses is empty: give one pose, or one at each of its times");
  if (track.times.size() != track.poses.size())
    throw invalid_argument(name + " has " + std::to_string(track.times.size()) + " times and " +
                           std::to_string(track.poses.size()) + " poses: give each pose a time");
  for (std::size_t k = 0; k < track.poses.size(); ++k) {
    std::string const key = "[" + std::to_string(k) + "]", pose = name + ".poses" + key;
    if (!std::isfinite(track.times[k])) throw invalid_argument(name + ".times" + key + " is not finite");
    if (k > 0 && !(track.times[k] > track.times[k - 1]))
      throw invalid_argument(name + ".times" + key + " is not after the one before: sort the poses by their times");
    require_instance(track.poses[k], models, pose);
    if (track.poses[k].model != track.poses[0].model)
      throw invalid_argument(pose + ".model is another than the first pose's: a track is of one model");
    if (track.poses[k].scale != track.poses[0].scale)
      throw invalid_argument(pose + ".scale is another than the first pose's: a track is of one scale");
  }
}

}}  // namespace gart::GART_ISA
