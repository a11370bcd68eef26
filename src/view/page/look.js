// How the model is drawn: as Gaussians, ellipsoids or points, fainter or larger, before another background.

import {colorOf, hex} from './colors.js';
import {radios} from './radios.js';

const own = {shape: 'gaussians', opacity: 1, size: 1, background: null};
const shapes = {gaussians: 'Gaussians', ellipsoids: 'Ellipsoids', points: 'Points'};

// changed(moving): the look is another one.
export function lookPanel(ui, changed) {
  let look = {...own}, background = [0, 0, 0];
  const choice = radios(ui.shapes, 'shape', shapes, (shape) => set({shape}));
  const set = (part, moving = false) => {
    look = {...look, ...part};
    write();
    changed(moving);
  };
  // The sliders are of powers of two.
  for (const name of ['opacity', 'size'])
    ui[name].addEventListener('input', () => set({[name]: Number((2 ** Number(ui[name].value)).toPrecision(6))}, true));
  ui.background.addEventListener('input', () => set({background: colorOf(ui.background.value)}, true));
  ui.reset.addEventListener('click', () => set(own));

  function write() {
    choice.set(look.shape);
    for (const name of ['opacity', 'size']) {
      ui[name].value = Math.log2(look[name]);
      ui[`${name}Now`].textContent = `× ${Number(look[name].toPrecision(2))}`;
    }
    ui.background.value = hex(look.background ?? background);
    ui.reset.disabled = Object.keys(own).every((key) => look[key] === own[key]);
  }
  return {
    value: () => look,
    restore(kept) {
      look = {...own, ...kept};
      write();
    },
    model(color) {
      background = color;
      write();
    },
  };
}
