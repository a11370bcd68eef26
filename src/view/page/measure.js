// The distance between two chosen points, in the model's units or by a known length. gart says where the ray meets the
// scene. While it is on, each pair of points is measured; switching it off clears all.

import {norm, scale, add, sub} from './vector.js';
import {stroked} from './overlay.js';

const digits = (x) => Number(x.toPrecision(5)).toString();

export function ruler(ui, say, changed) {
  let points = [], active = false, factor = 1;
  const distance = () => factor * norm(sub(points[0], points[1]));
  const write = () => {
    const whole = points.length === 2;
    ui.button.setAttribute('aria-pressed', active);
    ui.output.textContent = whole ? digits(distance()) : !active ? '–' : points.length ? 'point at the second place' : 'point at two places';
    ui.length.disabled = !whole;
    ui.length.value = whole ? digits(distance()) : '';
    ui.scale.textContent = factor === 1 ? 'In the units of the capture.' : `One unit of the capture is ${digits(factor)}.`;
    ui.forget.hidden = factor === 1;
  };
  const activate = (on) => {
    active = on, points = [];
    write();
    changed();
    say(on ? 'Measure: point at two places, or press Enter for the middle of the view.' : 'The measure is off.');
  };
  const setFactor = (value) => {
    factor = value;
    write();
    changed();
  };
  ui.button.addEventListener('click', () => activate(!active));
  ui.length.addEventListener('change', () => {
    const known = ui.length.valueAsNumber, shown = distance();
    if (!(known > 0 && Number.isFinite(known) && shown > 0)) return write();
    setFactor(factor * known / shown);
    say(`The scale is set: one unit of the capture is ${digits(factor)}.`);
  });
  ui.forget.addEventListener('click', () => setFactor(1));
  write();
  return {
    active: () => active,
    toggle: () => activate(!active),
    factor: () => factor,
    restore(value) {
      factor = value > 0 ? value : 1, points = [];
      write();
    },
    picked({hit, point}) {
      if (!active) return;
      if (!hit) return say('There is nothing at that place.');
      points = points.length === 2 ? [point] : [...points, point];
      write();
      changed();
      if (points.length === 2) say(`Distance ${digits(distance())}`);
    },
    draw(pen, color) {
      if (points.length === 2) stroked(pen, color, 2, () => pen.line(points[0], points[1]));
      pen.draw.fillStyle = color;
      for (const point of points) pen.dot(point, 4.5);
      const middle = points.length === 2 && pen.place(scale(add(points[0], points[1]), 0.5));
      if (middle) pen.label(digits(distance()), middle);
    },
  };
}
