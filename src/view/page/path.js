// Keyframes, the smooth path that gart lays through them, its replay, and camera JSON in and out.

import {fromOrigin, poseOf, readCameras} from './camera.js';
import {saveFile} from './files.js';
import {keyRows} from './keylist.js';
import {drawPath} from './pathline.js';

const rate = 30;           // frames a second
const lineSteps = 24;      // pieces of the drawn line between two keyframes
const drawnAfter = 200;    // milliseconds without a change

// page: camera() the camera now, resized(camera) for the stage, show(camera) one of the path, rest() when it ends,
// ask(keyframes, frames, closed, times) -> a promise of the path's cameras, redraw(), say(text), origin() of the scene.
export function keyframes(ui, page) {
  let keys = [], path = null, playing = null, line = [], drawing = 0, asked = Promise.resolve();

  const changed = () => {
    path = null;
    keyRows(ui.list, keys, ui.timed.checked, {
      show: (key) => page.show(key.camera, true),
      move(from, to) {
        const times = keys.map((key) => key.time);
        keys.splice(to, 0, ...keys.splice(from, 1));
        keys.forEach((key, i) => (key.time = times[i]));  // the places are timed, not what stands there
        changed();
        ui.list.querySelectorAll('.wide')[to].focus();
      },
      remove(i) {
        keys.splice(i, 1);
        changed();
        (ui.list.querySelectorAll('.wide')[Math.min(i, keys.length - 1)] ?? ui.add).focus();
      },
      time(i, seconds) {
        const low = i > 0 ? keys[i - 1].time : -Infinity, high = keys[i + 1]?.time ?? Infinity;
        if (seconds > low && seconds < high) keys[i].time = seconds;
        else page.say('A keyframe comes after the one before it and before the next one.');
        changed();
      },
    });
    const few = keys.length < 2;
    ui.play.disabled = ui.savePath.disabled = ui.record.disabled = few;
    ui.saveKeys.disabled = keys.length === 0;
    ui.seconds.disabled = ui.timed.checked;
    ui.hint.hidden = !few;
    clearTimeout(drawing);
    drawing = setTimeout(drawLine, drawnAfter);
    page.redraw();
  };

  const seconds = () => Math.min(300, Math.max(0.1, ui.seconds.valueAsNumber || 5));
  // Of the keyframes from 0 on, and of the end of a closed path: as long after the last one as the others are apart.
  const times = () => {
    if (!ui.timed.checked) return null;
    const own = keys.map((key) => key.time - keys[0].time);
    return ui.closed.checked ? [...own, own.at(-1) * (1 + 1 / (own.length - 1))] : own;
  };
  const duration = () => times()?.at(-1) ?? seconds();
  // All of one size, as gart render --path needs.
  const sameSize = () => keys.map((key, i) => ({...page.resized(key.camera), name: `key${String(i).padStart(3, '0')}`}));

  async function cameras(frames) {
    const same = sameSize();
    const most = 15000 / new TextEncoder().encode(JSON.stringify(same[0])).length;
    if (same.length > most) throw new Error(`One path has room for ${Math.floor(most)} keyframes. Save them, and use gart render --path.`);
    const ask = () => page.ask(same, frames, ui.closed.checked, times());
    return (asked = asked.then(ask, ask));  // gart keeps one question of a kind
  }
  async function whole() {
    path ??= await cameras(Math.min(10000, Math.max(2, Math.round(duration() * rate))));
    return path;
  }
  async function drawLine() {
    line = [];
    try {
      if (keys.length > 1 && ui.draw.checked)
        line = (await cameras(Math.min(1000, lineSteps * keys.length))).map((camera) => poseOf(camera).place);
      if (line.length && ui.closed.checked) line.push(line[0]);
    } catch {
      // Without an answer there is no line; what is asked for next says why.
    }
    page.redraw();
  }

  // In time with the clock: slow frames skip parts of the path, at the same speed.
  async function play() {
    const all = await whole(), start = performance.now();
    ui.play.textContent = 'Stop';
    return new Promise((done) => {
      const step = () => {
        const i = Math.floor((performance.now() - start) * rate / 1000);
        page.show(all[Math.min(i, all.length - 1)]);
        if (i >= all.length || !playing) return end();
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

  // A new one comes as long after the last as those are apart.
  const nextTime = () => (keys.length < 2 ? 2 * keys.length : keys.at(-1).time + (keys.at(-1).time - keys[0].time) / (keys.length - 1));
  const add = () => {
    keys.push({camera: page.camera(), time: nextTime()});
    changed();
    page.say(`Keyframe ${keys.length} added.`);
  };
  // Evenly over the seconds of the whole, to begin with.
  const spread = () => keys.forEach((key, i) => (key.time = seconds() * i / Math.max(1, keys.length - 1)));
  const take = (all) => {
    keys = all;
    changed();
  };
  const toggle = orSay(async () => {
    if (stop() || keys.length < 2) return;
    await play();
  });
  ui.add.addEventListener('click', add);
  ui.play.addEventListener('click', toggle);
  for (const control of [ui.seconds, ui.closed, ui.draw]) control.addEventListener('change', changed);
  ui.timed.addEventListener('change', () => {
    if (ui.timed.checked) spread();
    changed();
  });
  ui.savePath.addEventListener('click', orSay(async () => saveFile('path.json', fromOrigin(await whole(), page.origin()))));
  ui.saveKeys.addEventListener('click', () =>
    saveFile('keyframes.json', fromOrigin(sameSize(), page.origin()).map((camera, i) => (ui.timed.checked ? {...camera, time: keys[i].time} : camera))));
  ui.load.addEventListener('change', orSay(async () => {
    const [file] = ui.load.files;
    if (!file) return;
    const read = readCameras(await file.text(), page.origin());
    read.forEach(poseOf);
    const timed = read.every(({time}, i) => Number.isFinite(time) && (i === 0 || time > read[i - 1].time));
    keys = read.map(({time, ...camera}) => ({camera, time: timed ? time : 0}));
    ui.timed.checked = timed && keys.length > 1;
    if (!timed) spread();
    changed();
    page.say(`${keys.length} keyframes from ${file.name}.`);
    ui.load.value = '';
  }));
  changed();
  return {
    add, toggle, stop, play: orSay(play),
    draw: (pen, color) => ui.draw.checked && drawPath(pen, line, keys, color),
    state: () => ({keys, timed: ui.timed.checked, seconds: ui.seconds.value, closed: ui.closed.checked}),
    restore(state) {
      ui.timed.checked = state?.timed ?? false, ui.closed.checked = state?.closed ?? false;
      ui.seconds.value = state?.seconds ?? 5;
      take(state?.keys ?? []);
    },
  };
}
