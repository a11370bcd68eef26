// Handles in the view: dots that a hand drags along an axis of the world.

const grip = 16;  // pixels about a handle that are the handle

export function handles() {
  let all = [];
  return {
    clear: () => (all = []),
    // moved(by): along axis k, in units of the world. step: a short way there, to see which way it goes.
    add(pen, color, point, k, step, moved, dropped) {
      pen.draw.fillStyle = color;
      const at = pen.dot(point, 6);
      const ahead = [...point];
      ahead[k] += step;
      const next = at && pen.place(ahead);
      if (next) all.push({at, perUnit: [next[0] - at[0], next[1] - at[1]], step, moved, dropped});
    },
    // The drag of the handle at that place; null where there is none.
    grab({x, y}) {
      const far = ({at}) => Math.hypot(at[0] - x, at[1] - y);
      const one = all.reduce((best, handle) => (!best || far(handle) < far(best) ? handle : best), null);
      if (!one || far(one) > grip) return null;
      const length2 = one.perUnit[0] ** 2 + one.perUnit[1] ** 2;
      if (length2 < 1e-6) return null;
      return {
        drag(_, [dx, dy]) {
          one.moved(((dx * one.perUnit[0] + dy * one.perUnit[1]) / length2) * one.step);
        },
        drop: one.dropped,
      };
    },
  };
}
