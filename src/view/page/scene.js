// The meshes and lights among the Gaussians: a list of them, and for the one that is chosen handles, its material, or
// its light. What is changed goes to gart, which answers with what there is by then.

import {add} from './vector.js';
import {stroked} from './overlay.js';
import {handles} from './handles.js';
import {colorOf, hex} from './colors.js';

const axisColors = ['#ff6b6b', '#5fd38d', '#6ea8ff'];
const arm = 0.14;  // of the extent: from what is moved to its handles

// on: {send(message) -> whether it went, changed(moving), redraw()}.
export function scenePanel(ui, on, say) {
  let parts = [], chosen = null, extent = 1, control = false, held = false;
  const grips = handles();
  const part = () => parts[chosen] ?? null;
  const edit = (change, moving) => {
    if (on.send({type: 'part', index: chosen, ...change})) on.changed(moving);
    else say('There is no connection.');
  };

  ui.material.addEventListener('change', () => edit({material: ui.material.value}));
  const lit = () => edit({color: colorOf(ui.color.value).map((c) => c * strength())}, true);
  // The slider is of powers of two.
  const strength = () => Number((2 ** Number(ui.strength.value)).toPrecision(6));
  for (const input of [ui.color, ui.strength])
    input.addEventListener('input', () => {
      part().color = colorOf(ui.color.value).map((c) => c * strength());
      lit();
      write();
    });
  const places = [0, 1, 2].map((k) => {
    const label = document.createElement('label');
    const input = Object.assign(document.createElement('input'), {type: 'number', step: 'any'});
    input.addEventListener('change', () => {
      if (Number.isFinite(input.valueAsNumber)) move(k, input.valueAsNumber - part().place[k]);
      write();
    });
    label.append('xyz'[k], input);
    ui.place.append(label);
    return input;
  });

  function move(k, by, moving = false) {
    const one = part(), way = [0, 0, 0];
    way[k] = by;
    one.place = add(one.place, way);
    if (!one.light) one.min = add(one.min, way), one.max = add(one.max, way);
    edit({place: one.place}, moving);
    write();
    on.redraw();
  }
  const choose = (i) => {
    chosen = i === chosen ? null : i;
    write();
    on.redraw();
  };

  function list() {
    ui.list.replaceChildren(...parts.map((one, i) => {
      const item = document.createElement('li'), button = Object.assign(document.createElement('button'), {type: 'button', className: 'wide'});
      button.append(one.name || `Mesh ${i + 1}`, Object.assign(document.createElement('small'), {textContent: one.light ? one.kind : ''}));
      button.addEventListener('click', () => choose(i));
      item.append(button);
      return item;
    }));
    ui.none.hidden = parts.length > 0;
  }
  function write() {
    const one = part();
    [...ui.list.querySelectorAll('button')].forEach((button, i) => button.setAttribute('aria-current', i === chosen));
    ui.part.hidden = !one;
    if (!one) return;
    ui.part.disabled = !control;
    ui.materialRow.hidden = one.light;
    ui.lightRows.hidden = !one.light;
    places.forEach((input, k) => (input.value = Number(one.place[k].toPrecision(5))));
    if (!one.light) return void (ui.material.value = one.kind);
    const most = Math.max(...one.color);
    const power = most > 0 ? Math.log2(most) : 0;
    ui.strength.value = power;
    ui.strengthNow.textContent = Number((2 ** power).toPrecision(2));
    ui.color.value = hex(most > 0 ? one.color.map((c) => c / most) : [1, 1, 1]);
  }

  return {
    // Of a scene that is opened; null where there is none.
    fill(all, {model, right}) {
      parts = all ?? [], extent = model.extent || 1, control = right === 'control';
      if (!part()) chosen = null;
      ui.onlooker.hidden = control;
      list();
      write();
    },
    // As gart has them now. What a hand holds is where the hand is.
    parts(all) {
      if (held) return;
      const same = all.length === parts.length && all.every((one, i) => one.name === parts[i].name);
      parts = all;
      if (!same) list();
      write();
      on.redraw();
    },
    draw(pen, color) {
      grips.clear();
      const one = part();
      if (!one) return;
      if (!one.light) {
        const corner = (i) => [0, 1, 2].map((k) => (i >> k & 1 ? one.max[k] : one.min[k]));
        stroked(pen, color, 1, () => {
          for (let i = 0; i < 8; ++i)
            for (let k = 0; k < 3; ++k) if (!(i >> k & 1)) pen.line(corner(i), corner(i | 1 << k));
        });
      } else {
        pen.draw.fillStyle = color;
        pen.dot(one.place, 4);
      }
      if (!control) return;
      axisColors.forEach((own, k) => {
        const end = [...one.place];
        end[k] += arm * extent + (one.light ? 0 : (one.max[k] - one.min[k]) / 2);
        stroked(pen, own, 2, () => pen.line(one.place, end));
        grips.add(pen, own, end, k, 1e-2 * extent, (by) => (held = true, move(k, by, true)), () => {
          held = false;
          edit({place: part().place});
        });
      });
    },
    grab: (place) => grips.grab(place),
  };
}
