// Keyframes, the smooth path that gart lays through them, its replay, and camera JSON in and out.

import {poseOf, readCameras} from './camera.js';
import {saveFile} from './files.js';

const rate = 30;  // frames a second

// page: camera() the camera now, resized(camera) for the stage, show(camera) one of the path, rest() when it ends,
// ask(keyframes, frames, closed) -> a promise of the path's cameras, say(text).
export function keyframes(ui, page) {
  let keys = [], path = null, playing = null;

  const changed = () => {
    path = null;
    ui.list.replaceChildren(...keys.map((key, i) => row(key, i)));
    const few = keys.length < 2;
    ui.play.disabled = ui.savePath.disabled = ui.record.disabled = few;
    ui.saveKeys.disabled = keys.length === 0;
    ui.hint.hidden = !few;
  };
  function row(key, i) {
    const item = document.createElement('li');
    const button = (text, label, action) => {
      const b = Object.assign(document.createElement('button'), {type: 'button', textContent: text});
      b.setAttribute('aria-label', label);
      b.addEventListener('click', action);
      return b;
    };
    const go = button(`Keyframe ${i + 1}`, `Go to keyframe ${i + 1}`, () => page.show(key, true));
    go.className = 'wide';
    item.append(go, button('↑', `Move keyframe ${i + 1} up`, () => i > 0 && move(i, i - 1)),
      button('×', `Remove keyframe ${i + 1}`, () => {
        keys.splice(i, 1);
        changed();
        (ui.list.querySelectorAll('.wide')[Math.min(i, keys.length - 1)] ?? ui.add).focus();
      }));
    return item;
  }
  const move = (from, to) => {
    keys.splice(to, 0, ...keys.splice(from, 1));
    changed();
    ui.list.querySelectorAll('.wide')[to].focus();
  };

  async function whole() {
    const seconds = Math.min(300, Math.max(0.1, ui.seconds.valueAsNumber || 5));
    const frames = Math.max(2, Math.round(seconds * rate));
    // All of one size, so that the frames of gart render --path are.
    const same = keys.map((key, i) => ({...page.resized(key), name: `key${String(i).padStart(3, '0')}`}));
    const most = 16000 / new TextEncoder().encode(JSON.stringify(same[0])).length;
    if (same.length > most) throw new Error(`One path has room for ${Math.floor(most)} keyframes. Save them, and use gart render --path.`);
    path ??= {frames, closed: ui.closed.checked, cameras: await page.ask(same, frames, ui.closed.checked)};
    return path.cameras;
  }
  const stale = () => (path = null);
  ui.seconds.addEventListener('change', stale);
  ui.closed.addEventListener('change', stale);

  // In time with the clock: where frames take longer, some of the path is left out, and none of its speed.
  async function play() {
    const cameras = await whole(), start = performance.now();
    ui.play.textContent = 'Stop';
    return new Promise((done) => {
      const step = () => {
        const i = Math.floor((performance.now() - start) * rate / 1000);
        page.show(cameras[Math.min(i, cameras.length - 1)]);
        if (i >= cameras.length || !playing) return end();
        playing.timer = requestAnimationFrame(step);
      };
      const end = () => {
        playing = null;
        ui.play.textContent = 'Play';
        page.rest();
        done();
      };
      playing = {end};
      step();
    });
  }
  const stop = () => {
    if (!playing) return false;
    cancelAnimationFrame(playing.timer);
    playing.end();
    return true;
  };
  const orSay = (action) => async (...given) => {
    try {
      await action(...given);
    } catch (fault) {
      page.say(fault.message);
    }
  };

  const add = () => {
    keys.push(page.camera());
    changed();
    page.say(`Keyframe ${keys.length} added.`);
  };
  const toggle = orSay(async () => {
    if (stop() || keys.length < 2) return;
    await play();
  });
  ui.add.addEventListener('click', add);
  ui.play.addEventListener('click', toggle);
  ui.savePath.addEventListener('click', orSay(async () => saveFile('path.json', await whole())));
  ui.saveKeys.addEventListener('click', () =>
    saveFile('keyframes.json', keys.map((key, i) => ({...page.resized(key), name: `key${i}`}))));
  ui.load.addEventListener('change', orSay(async () => {
    const [file] = ui.load.files;
    if (!file) return;
    const read = readCameras(await file.text());
    read.forEach(poseOf);
    keys = read;
    changed();
    page.say(`${keys.length} keyframes from ${file.name}.`);
    ui.load.value = '';
  }));
  changed();
  return {add, toggle, stop, play: orSay(play), playing: () => Boolean(playing)};
}
