#pragma once
/// \file
/// Instances that move: a pose between two. A sweep among them is traced in slices of time (rays/lidar.hpp,
/// rays_during), each by a scene of its own: what an actor is off by is half its way during a slice, at most.

#include <gart/instances/instance.hpp>
#include <gart/math/turn.hpp>

namespace gart { inline namespace GART_ISA {

/// The pose at `time` on the way from one (0) to another (1): the position in a line, the rotation by the shortest
/// turn, both evenly. Model and scale are the first one's. Times beyond go on alike.
inline instance between(instance const& from, instance const& to, double time) {
  instance out = from;
  out.position += (to.position - from.position) * time;
  out.rotation = turn_of(angles_of(to.rotation * glm::transpose(from.rotation)) * time) * from.rotation;
  return out;
}

}}  // namespace gart::GART_ISA
