// The path as a line in the view, with its keyframes on it.

import {poseOf} from './camera.js';
import {stroked} from './overlay.js';

export function drawPath(pen, line, keys, color) {
  if (line.length > 1)
    stroked(pen, color, 2, () => line.slice(1).forEach((place, i) => pen.line(line[i], place)));
  keys.forEach((key, i) => {
    pen.draw.fillStyle = color;
    const at = pen.dot(poseOf(key.camera).place, 4);
    if (at) pen.label(String(i + 1), at);
  });
}
