#pragma once
/// \file
/// The rays of lidars as a batch. A pattern has directions and times in the sensor's axes. A pose says where the sensor
/// is and how it moves while it looks about. Patterns need be neither separable nor of one azimuth seam.
///
///   ray_list const rays = rays_of(spinning_lidar(elevations, 1024), {.rotation = axes, .position = at});
///   traced_rays const seen = renderer->trace(rays.batch(), {});      // seen.median: ranges, a row of 1024 a beam
///
/// Axes of a sensor: x forward, y left, z up. Angles are in radians, azimuths from x to y, elevations up from there.
/// Arithmetic is in double, and a ray's origin relative to the sensor's position in the middle of the sweep.
/// Errors: invalid_argument for counts that disagree or numbers that are not finite.

#include <gart/core/error.hpp>
#include <gart/math/turn.hpp>
#include <gart/rays/ray_batch.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Where a sensor is, and how it moves during a sweep.
struct sensor_pose {
  mat3 rotation{1.0f};  ///< sensor to world; columns are the sensor's axes in the world
  vec3d position{0.0};  ///< in the world, in the middle of the sweep
  vec3 travel{0.0f};    ///< what it moves by during the sweep, in its own axes
  vec3 turn{0.0f};      ///< the same of its rotation: the axis times the angle
};

/// Which way rays go, and when.
struct lidar_pattern {
  std::vector<float> directions;  ///< [R][3], in the sensor's axes, of any length
  std::vector<float> times = {};  ///< [R], from 0 to 1 through the sweep; empty: all at once
};

/// A column of beams that turns: [beams][columns], time going with the column. `revolution` is the way of the azimuth
/// from the first column to past the last. It is -2 pi for once around clockwise. `azimuths`: of each beam, relative to
/// the column's; empty: none.
inline lidar_pattern spinning_lidar(std::vector<float> const& elevations, int columns,
                                    double revolution = -6.283185307179586, double first_azimuth = 0,
                                    std::vector<float> const& azimuths = {}) {
  if (columns < 1) throw invalid_argument("spinning_lidar: columns must be positive, not " + std::to_string(columns));
  if (!azimuths.empty() && azimuths.size() != elevations.size())
    throw invalid_argument("spinning_lidar: there are " + std::to_string(azimuths.size()) + " azimuths and " +
                           std::to_string(elevations.size()) + " elevations: give one for each beam, or none");
  lidar_pattern out;
  for (std::size_t beam = 0; beam < elevations.size(); ++beam)
    for (int column = 0; column < columns; ++column) {
      double const time = static_cast<double>(column) / columns, up = double{elevations[beam]};
      double const azimuth = first_azimuth + revolution * time + (azimuths.empty() ? 0 : double{azimuths[beam]});
      for (double const x : {std::cos(up) * std::cos(azimuth), std::cos(up) * std::sin(azimuth), std::sin(up)})
        out.directions.push_back(static_cast<float>(x));
      out.times.push_back(static_cast<float>(time));
    }
  return out;
}

/// Some rays of a pattern.
struct lidar_slice {
  lidar_pattern pattern;  ///< these alone
  std::vector<u32> rays;  ///< their numbers in the whole pattern
};

/// The rays of times from `from` to before `to`: those that see moving actors at poses of one time
/// (instances/instance_track.hpp). Errors: invalid_argument for a pattern without times.
inline lidar_slice rays_during(lidar_pattern const& pattern, float from, float to) {
  if (pattern.directions.size() != 3 * pattern.times.size())
    throw invalid_argument("rays_during: there are " + std::to_string(pattern.times.size()) +
                           " times in lidar_pattern, and " + std::to_string(pattern.directions.size()) +
                           " numbers of directions: give each ray a time");
  lidar_slice out;
  for (std::size_t i = 0; i < pattern.times.size(); ++i) {
    if (!(pattern.times[i] >= from && pattern.times[i] < to)) continue;
    out.rays.push_back(static_cast<u32>(i)), out.pattern.times.push_back(pattern.times[i]);
    for (std::size_t k = 0; k < 3; ++k) out.pattern.directions.push_back(pattern.directions[3 * i + k]);
  }
  return out;
}

/// The pattern's rays in the world, in its order, with its times. t_max: where they end; 0: nowhere.
inline ray_list rays_of(lidar_pattern const& pattern, sensor_pose const& pose, float t_max = 0) {
  std::size_t const n = pattern.directions.size() / 3;
  if (pattern.directions.size() % 3 != 0 || (!pattern.times.empty() && pattern.times.size() != n))
    throw invalid_argument("lidar_pattern: " + std::to_string(pattern.directions.size()) +
                           " numbers of directions and " + std::to_string(pattern.times.size()) +
                           " times: a ray has three, and one or none");
  mat3d const axes(pose.rotation);
  vec3d const travel(pose.travel), turn(pose.turn);
  bool const moves = !pattern.times.empty() && (glm::length(travel) > 0 || glm::length(turn) > 0);
  ray_list out;
  out.frame = pose.position;
  out.directions.reserve(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    float const* const d = &pattern.directions[3 * i];
    vec3d direction(d[0], d[1], d[2]);
    double const length = glm::length(direction);
    if (!(length > 0 && length < 1e15))
      throw invalid_argument("lidar_pattern.directions[" + std::to_string(i) +
                             "] has no length, or none that is finite");
    direction /= length;
    if (moves) {
      double const time = double{pattern.times[i]} - 0.5;
      if (!(time >= -0.5 && time <= 0.5))
        throw invalid_argument("lidar_pattern.times[" + std::to_string(i) + "] does not lie between 0 and 1");
      direction = turn_of(turn * time) * direction;
      vec3d const moved = axes * (travel * time);
      for (int k = 0; k < 3; ++k) out.origins.push_back(static_cast<float>(moved[k]));
    }
    vec3d const world = axes * direction;
    for (int k = 0; k < 3; ++k) out.directions.push_back(static_cast<float>(world[k]));
  }
  if (t_max > 0) out.t_max.assign(n, t_max);
  out.times = pattern.times;
  return out;
}

}}  // namespace gart::GART_ISA
