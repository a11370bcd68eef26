// The lens: one that the page offers by name, or one of the capture's cameras.

import {lenses} from './camera.js';
import {isPinhole} from './lens.js';

export function lensPanel(ui, view) {
  let own = new Map();
  const option = (value, title) => Object.assign(document.createElement('option'), {value, textContent: title});
  function write() {
    const {camera, name, angle} = view.lens, offered = view.offered;
    ui.lens.value = camera ? `own ${camera.camera_model}` : name;
    ui.lens.title = camera ? 'The lens of a camera of the capture or of a file' : '';
    ui.angleRow.hidden = !offered?.most;
    if (!offered?.most) return;
    ui.angle.min = offered.least, ui.angle.max = offered.most, ui.angle.value = angle;
    ui.angleNow.textContent = `${Math.round(angle)}°`;
  }
  ui.lens.addEventListener('change', () => {
    const name = ui.lens.value;
    view.setLens(name.startsWith('own ') ? {camera: own.get(name.slice(4))} : {name, angle: name === 'fisheye' ? 180 : 60});
    write();
  });
  ui.angle.addEventListener('input', () => {
    view.leave();
    view.lens = {...view.lens, angle: Number(ui.angle.value)};
    view.changed(true);
    write();
  });
  return {
    write,
    fill(cameras) {
      own = new Map(cameras.filter((c) => !isPinhole(c.camera)).map((c) => [c.camera.camera_model, c.camera]).reverse());
      ui.lens.replaceChildren(...Object.entries(lenses).map(([name, {title}]) => option(name, title)),
        ...[...own.keys()].map((model) => option(`own ${model}`, `${model}, the capture’s`)));
    },
  };
}
