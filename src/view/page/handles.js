// Handles in the view: dots that a hand drags along a short way in the world.

import {add} from './vector.js';

const grip = 16;  // pixels about a handle that are the handle

// A way along axis k.
export const along = (k, length) => [0, 1, 2].map((i) => (i === k ? length : 0));

export function handles() {
  let all = [];
  return {
    clear: () => (all = []),
    // moved(by): in parts of the way.
    add(pen, color, point, way, moved, dropped) {
      pen.draw.fillStyle = color;
      const at = pen.dot(point, 6), next = at && pen.place(add(point, way));
      if (next) all.push({at, whole: [next[0] - at[0], next[1] - at[1]], moved, dropped});
    },
    // The drag of the handle at that place; null where there is none.
    grab({x, y}) {
      const far = ({at}) => Math.hypot(at[0] - x, at[1] - y);
      const one = all.reduce((best, handle) => (!best || far(handle) < far(best) ? handle : best), null);
      if (!one || far(one) > grip) return null;
      const length2 = one.whole[0] ** 2 + one.whole[1] ** 2;
      if (length2 < 1e-6) return null;
      return {
        drag(_, [dx, dy]) {
          one.moved((dx * one.whole[0] + dy * one.whole[1]) / length2);
        },
        drop: one.dropped,
      };
    },
  };
}
