// How a motion of the hand moves the camera: round a point, through the air, or over the ground.
// A motion: turn = [across, down] in radians, shift = [right, down] as shares of the distance to what is looked at,
// step = [right, down, forward] in units of the speed, zoom = a factor.

import {add, cross, dot, norm, scale, sub, unit} from './vector.js';
import {carriedRound, moved, turnedPose} from './pose.js';

const steepest = 0.995;  // of the view against the vertical, so that up and down stay apart

// A turn by so much would pass straight up or down.
const tooSteep = (forward, up, angle) => {
  const rise = dot(forward, up);
  return (rise > steepest && angle > 0) || (rise < -steepest && angle < 0);
};

export const styles = {
  orbit: {
    title: 'Orbit',
    turn(pose, [across, down], {pivot, up}) {
      const round = carriedRound(pose, pivot, up, -across);
      // Dragging down lifts the camera: what is seen follows the hand.
      return tooSteep(round.forward, up, -down) ? round : carriedRound(round, pivot, round.right, -down);
    },
    zoom(pose, factor, {pivot, extent}) {
      const away = sub(pose.place, pivot), least = 1e-3 * extent, most = 1e3 * extent;
      const distance = Math.min(most, Math.max(least, norm(away) * factor));
      return {...pose, place: add(pivot, scale(unit(away), distance))};
    },
  },
  fly: {
    title: 'Fly',
    turn: looking,
    step: (pose, step, {speed}) => moved(pose, step.map((x) => x * speed)),
    zoom: (pose, factor, {speed}) => moved(pose, [0, 0, -2 * speed * Math.log(factor)]),
  },
  walk: {
    title: 'Walk',
    turn: looking,
    // Over the ground: at constant height. Q and E change the height.
    step(pose, [right, down, forward], {speed, up}) {
      const flat = unit(cross(up, pose.right)), side = unit(cross(flat, up));
      const ahead = dot(flat, pose.forward) < 0 ? scale(flat, -1) : flat;
      const way = add(add(scale(side, right), scale(up, -down)), scale(ahead, forward));
      return {...pose, place: add(pose.place, scale(way, speed))};
    },
    zoom(pose, factor, world) {
      return this.step(pose, [0, 0, -2 * Math.log(factor)], world);
    },
  },
};

function looking(pose, [across, down], {up}) {
  const turned = turnedPose(pose, up, across);
  return tooSteep(turned.forward, up, down) ? turned : turnedPose(turned, turned.right, down);
}

// Sideways and down by shares of the distance to the pivot, which comes along: what is under the hand stays there.
export function shifted(pose, [right, down], world) {
  const far = Math.max(dot(sub(world.pivot, pose.place), pose.forward), 0.05 * world.extent);
  const next = moved(pose, [-right * far, -down * far, 0]);
  return {pose: next, pivot: add(world.pivot, sub(next.place, pose.place))};
}

// No roll: right lies level again. For walking, and for captures whose photographs were tilted.
export function levelled(pose, up) {
  const right = cross(pose.forward, up);
  if (norm(right) < 1e-4) return pose;
  const r = unit(right);
  return {...pose, right: r, down: cross(pose.forward, r)};
}

// What lies ahead at about the distance of `centre`: the point to go round after a jump.
export function pivotAhead(pose, centre, extent) {
  const far = dot(sub(centre, pose.place), pose.forward);
  return add(pose.place, scale(pose.forward, far > 0.05 * extent ? far : extent));
}
