// Lines of the world over the frame, projected by the shown frame's camera. So lines and image stay together however
// long a frame takes.

import {pixelOf, piecesOf} from './lens.js';
import {seenFrom} from './pose.js';
import {add, scale, sub} from './vector.js';

// A pen for one frame. rect: where its image lies, in CSS pixels of the canvas.
export function penFor(canvas, camera, pose, rect) {
  const draw = canvas.getContext('2d'), ratio = canvas.width / canvas.clientWidth || 1;
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  if (!camera) return null;
  const toStage = ([u, v]) => [rect.x + (u / camera.width) * rect.width, rect.y + (v / camera.height) * rect.height];
  const pieces = piecesOf(camera), near = 1e-3;
  draw.save();
  draw.beginPath();
  draw.rect(rect.x, rect.y, rect.width, rect.height);
  draw.clip();

  const place = (point) => {
    const pixel = pixelOf(camera, seenFrom(pose, point));
    return pixel && toStage(pixel);
  };
  // The part of a line that lies before a pinhole.
  const clipped = (a, b) => {
    if (pieces > 1) return [a, b];
    const za = seenFrom(pose, a)[2], zb = seenFrom(pose, b)[2];
    if (za < near && zb < near) return null;
    const cut = (from, to, z, other) => add(from, scale(sub(to, from), (near * 1.01 - z) / (other - z)));
    return [za < near ? cut(a, b, za, zb) : a, zb < near ? cut(b, a, zb, za) : b];
  };

  return {
    draw,
    place,
    line(a, b) {
      const ends = clipped(a, b);
      if (!ends) return;
      let last = null;
      draw.beginPath();
      for (let i = 0; i <= pieces; ++i) {
        const here = place(add(ends[0], scale(sub(ends[1], ends[0]), i / pieces)));
        // Round the back of a sphere a line leaves on one side and comes in on the other.
        const jumps = here && last && pieces > 1 && Math.abs(here[0] - last[0]) > rect.width / 2;
        if (here && last && !jumps) draw.lineTo(...here);
        else if (here) draw.moveTo(...here);
        last = here;
      }
      draw.stroke();
    },
    // Where it is; null where it is not seen.
    dot(point, radius) {
      const here = place(point);
      if (!here || here[0] < rect.x || here[1] < rect.y || here[0] > rect.x + rect.width || here[1] > rect.y + rect.height) return null;
      draw.beginPath();
      draw.arc(here[0], here[1], radius, 0, 2 * Math.PI);
      draw.fill();
      draw.lineWidth = 1.5;
      draw.strokeStyle = 'rgba(0, 0, 0, 0.55)';
      draw.stroke();
      return here;
    },
    label(text, [x, y]) {
      draw.font = '12px system-ui, sans-serif';
      const wide = draw.measureText(text).width, fill = draw.fillStyle;
      const left = Math.max(rect.x + 4, Math.min(x + 10, rect.x + rect.width - wide - 16));
      draw.fillStyle = 'rgba(16, 18, 20, 0.78)';
      draw.beginPath();
      draw.roundRect(left, y - 24, wide + 12, 20, 4);
      draw.fill();
      draw.fillStyle = '#fff';
      draw.fillText(text, left + 6, y - 10);
      draw.fillStyle = fill;
    },
    done: () => draw.restore(),
  };
}

// A line that reads on light and on dark: a dark one under a coloured one.
export function stroked(pen, color, width, lines) {
  for (const [style, thick] of [['rgba(0, 0, 0, 0.45)', width + 1.5], [color, width]]) {
    pen.draw.strokeStyle = style, pen.draw.lineWidth = thick;
    lines();
  }
}
