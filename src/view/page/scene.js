// The meshes and lights among the Gaussians: a list of them, and for the one that is chosen handles, its material, or
// its light. What is changed goes to gart, which answers with what there is by then.

import {add, after, scale, sub} from './vector.js';
import {stroked} from './overlay.js';
import {along, handles} from './handles.js';
import {radios} from './radios.js';
import {colorOf, hex} from './colors.js';

const axisColors = ['#ff6b6b', '#5fd38d', '#6ea8ff'];
const arm = 0.14;  // of the extent: from what is moved to its handles
const step = 0.01;  // of the extent, or of a size: how far handles go to see which way that is on the screen
const ways = {move: 'Move', turn: 'Turn', size: 'Resize'};

// on: {send(message) -> whether it went, changed(moving), redraw()}.
export function scenePanel(ui, on, say) {
  let parts = [], chosen = null, extent = 1, control = false, way = 'move';
  let held = null;  // the part as a hand took it, and how far it has gone from there
  const grips = handles();
  const part = () => parts[chosen] ?? null;
  const edit = (change, moving) => {
    if (on.send({type: 'part', index: chosen, ...change})) on.changed(moving);
    else say('There is no connection.');
  };

  const wayChoice = radios(ui.ways, 'hands', ways, (name) => {
    way = name;
    on.redraw();
  });
  wayChoice.set(way);
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
    const one = part(), shift = along(k, by);
    one.place = add(one.place, shift);
    if (!one.light) one.min = add(one.min, shift), one.max = add(one.max, shift);
    edit({place: one.place}, moving);
    write();
    on.redraw();
  }
  // What a hand does to a part: `far` is how far it has gone, from 0.
  const hold = (k = null) => (held ??= {...structuredClone(part()), k, far: 0});
  const drop = (last) => () => {
    held = null;
    edit(last());
  };
  function turn(k, by) {
    const {far, rotation, place} = (hold(k).far += by, held), half = far / 2;
    part().rotation = after([Math.cos(half), ...along(k, Math.sin(half))], rotation);
    edit({rotation: part().rotation, about: place}, true);
    on.redraw();
  }
  function resize(by) {
    const {far, place} = (hold().far += by, held), times = Math.max(0.02, 1 + far), one = part();
    one.scale = scale(held.scale, times);
    for (const side of ['min', 'max']) one[side] = add(place, scale(sub(held[side], place), times));
    edit({scale: one.scale, about: place}, true);
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
    ui.ways.hidden = one.light;
    places.forEach((input, k) => (input.value = Number(one.place[k].toPrecision(5))));
    if (!one.light) return void (ui.material.value = one.kind);
    const most = Math.max(...one.color);
    const power = most > 0 ? Math.log2(most) : 0;
    ui.strength.value = power;
    ui.strengthNow.textContent = Number((2 ** power).toPrecision(2));
    ui.color.value = hex(most > 0 ? one.color.map((c) => c / most) : [1, 1, 1]);
  }

  function arms(pen, one) {
    const short = step * extent;
    axisColors.forEach((own, k) => {
      const end = add(one.place, along(k, arm * extent + (one.light ? 0 : (one.max[k] - one.min[k]) / 2)));
      stroked(pen, own, 2, () => pen.line(one.place, end));
      grips.add(pen, own, end, along(k, short), (by) => (hold(), move(k, by * short, true)), drop(() => ({place: part().place})));
    });
  }
  // About each axis, through the middle as it was when the hand took it.
  function rings(pen, one) {
    const {place, min, max} = held ?? one, radius = arm * extent + Math.max(...sub(max, min)) / 2, sides = 48;
    axisColors.forEach((own, k) => {
      const on = (angle) => add(along((k + 1) % 3, Math.cos(angle)), along((k + 2) % 3, Math.sin(angle)));
      const at = (angle) => add(place, scale(on(angle), radius));
      stroked(pen, own, 2, () => {
        for (let i = 0; i < sides; ++i) pen.line(at(2 * Math.PI * i / sides), at(2 * Math.PI * (i + 1) / sides));
      });
      const dot = Math.PI / 4 + (held?.k === k ? held.far : 0);
      grips.add(pen, own, at(dot), scale(on(dot + Math.PI / 2), step * radius), (by) => turn(k, by * step), drop(() => ({rotation: part().rotation, about: place})));
    });
  }
  // At the corner that goes farthest over the screen.
  function sizer(pen, one, color, corner) {
    const middle = pen.place(one.place);
    const far = (i) => {
      const here = pen.place(corner(i));
      return here && middle ? Math.hypot(here[0] - middle[0], here[1] - middle[1]) : -1;
    };
    const end = corner([0, 1, 2, 3, 4, 5, 6, 7].reduce((best, i) => (far(i) > far(best) ? i : best)));
    const whole = sub((held ?? one).max, (held ?? one).place), size = Math.hypot(...whole) || 1;
    const way = sub(end, one.place), times = size / (Math.hypot(...way) || 1);
    stroked(pen, color, 2, () => pen.line(one.place, end));
    grips.add(pen, color, end, scale(way, step * times), (by) => resize(by * step), drop(() => ({scale: part().scale, about: part().place})));
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
      const corner = (i) => [0, 1, 2].map((k) => (i >> k & 1 ? one.max[k] : one.min[k]));
      if (!one.light) {
        stroked(pen, color, 1, () => {
          for (let i = 0; i < 8; ++i)
            for (let k = 0; k < 3; ++k) if (!(i >> k & 1)) pen.line(corner(i), corner(i | 1 << k));
        });
      } else {
        pen.draw.fillStyle = color;
        pen.dot(one.place, 4);
      }
      if (!control) return;
      if (one.light || way === 'move') arms(pen, one);
      else if (way === 'turn') rings(pen, one);
      else sizer(pen, one, color, corner);
    },
    grab: (place) => grips.grab(place),
  };
}
