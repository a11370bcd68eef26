// The capture's cameras as small pyramids, and which of them a hand points at.

import {isPinhole} from './lens.js';
import {poseOf} from './camera.js';
import {add, norm, scale, sub} from './vector.js';
import {stroked} from './overlay.js';

const reach = 14;  // pixels about the tip that count as the camera

// Tip and corners of a camera's pyramid. A wide lens has one of 90 degrees: its own corners may lie behind it.
function pyramid(camera, size) {
  const {place, right, down, forward} = poseOf(camera);
  const half = isPinhole(camera)
    ? [camera.width / 2 / camera.fx, camera.height / 2 / camera.fy].map((x) => Math.min(1.5, x))
    : [1, camera.height / camera.width];
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([sx, sy]) =>
    add(add(place, scale(forward, size)), add(scale(right, sx * half[0] * size), scale(down, sy * half[1] * size))));
  return {place, corners};
}

// Small against the distances between cameras, so that many of them do not cover the scene.
export function frustaOf(cameras, extent) {
  const places = cameras.map((c) => poseOf(c.camera).place);
  const nearest = places.map((p) => Math.min(...places.filter((q) => q !== p).map((q) => norm(sub(p, q))), extent));
  const typical = nearest.sort((a, b) => a - b)[nearest.length >> 1] ?? extent;
  const size = Math.min(0.08 * extent, Math.max(0.02 * extent, 0.4 * typical));
  return cameras.map((c) => ({...pyramid(c.camera, size), index: c.index, name: c.name, test: c.test}));
}

export function drawFrusta(pen, frusta, colors, pointedAt) {
  const tips = [];
  for (const f of frusta) {
    const color = f.index === pointedAt ? colors.accent : f.test ? colors.second : '#f3f4f5';
    stroked(pen, color, f.index === pointedAt ? 2 : 1, () => {
      f.corners.forEach((corner, i) => (pen.line(f.place, corner), pen.line(corner, f.corners[(i + 1) % 4])));
    });
    const tip = pen.place(f.place);
    if (tip) tips.push({index: f.index, tip});
    if (tip && f.index === pointedAt) pen.label(f.test ? `${f.name} (test)` : f.name, tip);
  }
  return tips;
}

export function pointedAt(tips, {x, y}) {
  let best = null, least = reach;
  for (const {index, tip} of tips) {
    const d = Math.hypot(tip[0] - x, tip[1] - y);
    if (d < least) least = d, best = index;
  }
  return best;
}
