// A camera's pose: its place, and its axes right, down and forward (OpenCV's) in the world.

import {add, cross, dot, scale, sub, turned, unit} from './vector.js';

export function lookingAt(place, target, up) {
  const forward = unit(sub(target, place));
  let right = cross(forward, up);
  if (Math.hypot(...right) < 1e-6) right = cross(forward, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]);
  return squared({place, right, down: [0, 0, 0], forward});
}

// The same with axes at right angles again: what rounding has bent.
function squared({place, right, forward}) {
  const f = unit(forward);
  const r = unit(sub(right, scale(f, dot(right, f))));
  return {place, right: r, down: cross(f, r), forward: f};
}

// Turned in its place about an axis of the world.
export function turnedPose(pose, axis, angle) {
  return squared({place: pose.place, right: turned(pose.right, axis, angle), forward: turned(pose.forward, axis, angle)});
}

// Carried round a point, as if the axis went through it.
export function carriedRound(pose, point, axis, angle) {
  const moved = turnedPose(pose, axis, angle);
  moved.place = add(point, turned(sub(pose.place, point), axis, angle));
  return moved;
}

export function moved(pose, [right, down, forward]) {
  const step = add(add(scale(pose.right, right), scale(pose.down, down)), scale(pose.forward, forward));
  return {...pose, place: add(pose.place, step)};
}

export function toRows({place, right, down, forward}) {
  return [0, 1, 2].map((i) => [right[i], down[i], forward[i], place[i]]).concat([[0, 0, 0, 1]]);
}

export function fromRows(rows) {
  const column = (k) => [rows[0][k], rows[1][k], rows[2][k]];
  return squared({place: column(3), right: column(0), forward: column(2)});
}

// A point of the world in the camera's axes.
export function seenFrom(pose, point) {
  const d = sub(point, pose.place);
  return [dot(d, pose.right), dot(d, pose.down), dot(d, pose.forward)];
}
