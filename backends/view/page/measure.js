// The distance between two points that were pointed at, in the model's units. gart says where the ray meets the scene.

import {norm, scale, add, sub} from './vector.js';
import {stroked} from './overlay.js';

export function ruler(button, output, say) {
  let points = [], active = false;
  const distance = () => norm(sub(points[0], points[1]));
  const write = () => {
    button.setAttribute('aria-pressed', active);
    output.textContent =
      points.length === 2 ? distance().toPrecision(5)
      : !active ? '–'
      : points.length ? 'point at the second place' : 'point at two places';
  };
  const activate = (on) => {
    active = on;
    if (on) points = [];
    write();
    if (on) say('Measure: point at two places, or press Enter for the middle of the view.');
  };
  button.addEventListener('click', () => activate(!active));
  write();
  return {
    active: () => active,
    toggle: () => activate(!active),
    picked({hit, point}) {
      if (!active) return;
      if (!hit) return say('There is nothing at that place.');
      points.push(point);
      if (points.length === 2) {
        active = false;
        say(`Distance ${distance().toPrecision(5)}`);
      }
      write();
    },
    draw(pen, color) {
      if (points.length === 2) stroked(pen, color, 2, () => pen.line(points[0], points[1]));
      pen.draw.fillStyle = color;
      for (const point of points) pen.dot(point, 4.5);
      const middle = points.length === 2 && pen.place(scale(add(points[0], points[1]), 0.5));
      if (middle) pen.label(distance().toPrecision(5), middle);
    },
  };
}
