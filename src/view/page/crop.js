// The crop box: six numbers, and six handles in the middles of its faces. Gaussians whose centres are outside are not
// traced.

import {add, scale} from './vector.js';
import {stroked} from './overlay.js';
import {along, handles} from './handles.js';

const axes = ['x', 'y', 'z'];

export function cropBox(form, toggle, resetButton, changed) {
  let whole = {min: [-1, -1, -1], max: [1, 1, 1]}, box = null;
  const grips = handles();
  const fields = [];
  for (const side of ['min', 'max'])
    axes.forEach((axis, k) => {
      const label = document.createElement('label');
      label.append(`${axis} ${side === 'min' ? 'from' : 'to'}`);
      const input = Object.assign(document.createElement('input'), {type: 'number', step: 'any', name: `${side}-${axis}`});
      input.addEventListener('change', () => {
        if (Number.isFinite(input.valueAsNumber)) set(side, k, input.valueAsNumber);
        else write();
      });
      label.append(input);
      form.append(label);
      fields.push({input, side, k});
    });

  const write = () => {
    form.disabled = resetButton.disabled = !box;
    toggle.checked = Boolean(box);
    for (const {input, side, k} of fields) input.value = Number((box ?? whole)[side][k].toPrecision(4));
  };
  // A face stops at the one opposite.
  function set(side, k, value) {
    const thin = 1e-3 * (whole.max[k] - whole.min[k] || 1);
    box[side][k] = side === 'min' ? Math.min(value, box.max[k] - thin) : Math.max(value, box.min[k] + thin);
    write();
    changed();
  }
  const use = (on) => {
    box = on ? structuredClone(whole) : null;
    write();
    changed();
  };
  toggle.addEventListener('change', () => use(toggle.checked));
  resetButton.addEventListener('click', () => use(true));

  const middleOf = (side, k) => {
    const p = scale(add(box.min, box.max), 0.5);
    p[k] = box[side][k];
    return p;
  };
  return {
    // Of another model, with the box that it had before, if any.
    bounds(min, max, before = null) {
      whole = {min: [...min], max: [...max]};
      box = before;
      write();
    },
    value: () => box,
    draw(pen, color) {
      grips.clear();
      if (!box) return;
      const corner = (i) => axes.map((_, k) => (i >> k & 1 ? box.max[k] : box.min[k]));
      stroked(pen, color, 1.5, () => {
        for (let i = 0; i < 8; ++i)
          for (let k = 0; k < 3; ++k) if (!(i >> k & 1)) pen.line(corner(i), corner(i | 1 << k));
      });
      for (const {side, k} of fields) {
        const step = 1e-2 * (whole.max[k] - whole.min[k]);
        grips.add(pen, color, middleOf(side, k), along(k, step), (by) => set(side, k, box[side][k] + by * step));
      }
    },
    grab: (place) => grips.grab(place),
  };
}
