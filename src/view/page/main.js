// The page: what the reader sees and touches, tied to the view and to gart.

import {connect} from './connection.js';
import {questions} from './ask.js';
import {View} from './view.js';
import {frameShower, rateMeter} from './frames.js';
import {penFor} from './overlay.js';
import {drawFrusta, frustaOf, pointedAt} from './frusta.js';
import {listenTo} from './gestures.js';
import {fromOrigin, poseOf} from './camera.js';
import {styles} from './navigation.js';
import {modes, showLegend} from './legend.js';
import {lensPanel} from './lenspanel.js';
import {lookPanel} from './look.js';
import {featureLegend, featurePanel} from './features.js';
import {imagePanel} from './image.js';
import {cropBox} from './crop.js';
import {scenePanel} from './scene.js';
import {fileDrop} from './drop.js';
import {ruler} from './measure.js';
import {commandPanel} from './command.js';
import {keyframes} from './path.js';
import {recorder} from './record.js';
import {photoSplit} from './photo.js';
import {trainingPanel} from './training.js';
import {cameraList} from './cameras.js';
import {modelList} from './models.js';
import {radios} from './radios.js';
import {narrow, tabs} from './tabs.js';
import {saveFile} from './files.js';
import {keep, kept} from './keep.js';
import {notes} from './notes.js';
import {norm, sub} from './vector.js';

const $ = (id) => document.getElementById(id);
const stage = $('stage'), lines = $('lines'), frame = $('frame');
const {say, aloud} = notes($('say'), $('note'));
const count = (n) => n.toLocaleString('en');

let cameras = [], frusta = [], tips = [], pointed = null, shown = null, hello = null;
const waiting = [];
const meter = rateMeter();

const {ask, answer, failed, lost: unanswered} = questions((message) => connection.send(message));
const connection = connect({
  hello: welcome,
  frame: frameShower(frame, frameShown),
  image: answer,
  picked: answer,
  path: answer,
  status(message) {
    training.status(message);
    // Views at rest are requested again, since the model has changed; their share of time limits them.
    if (!message.paused && !document.hidden) view.refresh();
  },
  curve: (message) => training.curve(message),
  scores: ({psnr}) => list.scores(psnr),
  scene: ({parts}) => scene.parts(parts),
  note: ({what}) => say(what),
  refused: ({what, why}) => say(`Refused: ${what}, ${why}`),
  // A question that failed is told where it was asked.
  error: (message) => (message.of === 'view' ? say(message.what) : failed(message)),
  closed(seconds, why) {
    lost(`The connection is lost${why ? ` (${why})` : ''}. Trying again in ${seconds} s.`);
  },
  ended: (why) => lost(why === 'gart ends' ? 'gart has ended.' : why),
});
function lost(text) {
  unanswered();
  $('lost').firstElementChild.textContent = text;
  $('lost').hidden = false;
  $('state').textContent = 'Not connected';
  $('state').classList.add('bad');
}
$('again').addEventListener('click', () => connection.again());

const view = new View(connection, () => {
  photo.through(null);
  list.mark(null);
  if (view.mode === 'error') setMode('colour');
  lens.write();
}, () => stage.setAttribute('aria-busy', true));

function welcome(message) {
  const again = hello?.model.name === message.model.name && hello.open === message.open;
  hello = message;
  cameras = hello.cameras;
  $('lost').hidden = true;
  $('state').classList.remove('bad');
  $('state').textContent = hello.right === 'control' ? 'Connected' : 'Connected, to look';
  $('name').textContent = hello.model.name;
  document.title = `${hello.model.name} – gart`;
  const {gaussians, sh_degree: bands, kernel_degree: kernel} = hello.model;
  $('about').textContent = `${count(gaussians)} Gaussians, SH degree ${bands}${kernel === 2 ? '' : `, kernel degree ${kernel}`}`;
  $('frame-id').title = `gart ${hello.gart}`;
  frusta = frustaOf(cameras, hello.model.extent);
  list.fill(cameras);
  models.fill(hello.models, hello.open);
  panel.offer('cameras', cameras.length > 0);
  panel.offer('training', hello.training);
  panel.offer('scene', hello.scene !== null);
  scene.fill(hello.scene, hello);
  $('add-row').hidden = hello.right !== 'control';
  training.rights(hello.right);
  modeChoice.offer((name) => hello.modes.includes(name));
  look.model(hello.background);
  if (again) return view.changed();
  begin(kept(modelKey()));
  if (hello.training && !narrow()) panel.choose('training');
}
const origin = () => hello?.model.origin ?? [0, 0, 0];
const modelKey = () => `${hello.open} ${hello.model.name}`;

// A model that is new to the page, or that it was on before it was loaded again.
function begin(before) {
  crop.bounds(hello.model.min, hello.model.max, before?.crop);
  look.restore(before?.look);
  features.restore(hello.model.features, before?.features);
  measure.restore(before?.factor);
  lens.fill(cameras);
  Object.assign(view, {crop: crop.value(), look: look.value(), features: features.value(), style: before?.style ?? 'orbit', mode: before?.mode ?? 'colour'});
  view.start(hello, before?.view);
  const through = cameras.find((c) => c.index === before?.view.through);
  if (through) jump(through);
  else photo.through(null);
  path.restore(before?.path);
  styleChoice.set(view.style);
  setMode(hello.modes.includes(view.mode) ? view.mode : 'colour');
  lens.write();
  writeCommand();
  if ($('image-width').value === '') $('image-like').click();
}
const keepAll = () => hello && keep(modelKey(), {
  view: view.state(), look: look.value(), features: features.value(), crop: crop.value(), factor: measure.factor(), path: path.state(), style: view.style, mode: view.mode,
});
addEventListener('pagehide', keepAll);

// ---- the stage

new ResizeObserver(() => {
  const {clientWidth, clientHeight} = stage, ratio = Math.min(2, devicePixelRatio || 1);
  lines.width = clientWidth * ratio, lines.height = clientHeight * ratio;
  view.resize(clientWidth, clientHeight, ratio);
  draw();
}).observe(stage);

function frameShown(header) {
  const next = view.asked(header.id);
  if (next) shown = next;
  if (!shown) return;
  const {rect} = shown;
  Object.assign(frame.style, {left: `${rect.x}px`, top: `${rect.y}px`, width: `${rect.width}px`, height: `${rect.height}px`});
  photo.layout(shown.through ? rect : null);
  showLegend($('legend'), header.mode, header.scale, header.mode === 'features' ? featureLegend(shown.features, features.count()) : {});
  meter.add();
  const [w, h] = header.full, part = header.width !== w || header.height !== h;
  $('size').textContent = part ? `${header.width} × ${header.height} of ${w} × ${h}` : `${w} × ${h}`;
  $('ms').textContent = `${header.ms < 10 ? header.ms.toFixed(1) : Math.round(header.ms)} ms`;
  const [have, of] = header.samples, growing = of > 1 && !part && (have > 1 || header.still);
  $('fps').textContent = growing ? `${have} of ${of} samples` : header.still ? 'at rest' : `${Math.round(meter.rate())} fps`;
  $('frame-id').textContent = `#${header.id}`;
  Object.assign(stage.dataset, {frame: header.id, still: header.still, mode: header.mode, size: `${header.width}x${header.height}`, samples: header.samples[0]});
  if (header.still && view.upTo(header.id)) {
    stage.setAttribute('aria-busy', false);
    for (const resolve of waiting.splice(0)) resolve();
    keepAll();
  }
  draw();
}

// When what is wanted last is on the canvas, whole.
const atRest = () => new Promise((resolve) => waiting.push(resolve));

function draw() {
  const pen = penFor(lines, shown?.camera, shown?.pose, shown?.rect ?? {});
  if (!pen) return;
  const style = getComputedStyle(document.documentElement);
  const colors = {accent: '#ffd166', second: style.getPropertyValue('--two')};
  tips = [];
  if ($('show-frusta').checked && frusta.length) {
    // Not the one that is looked through, nor any whose tip is at the eye.
    const near = 1e-3 * view.world.extent;
    tips = drawFrusta(pen, frusta.filter((f) => norm(sub(f.place, shown.pose.place)) > near), colors, pointed);
  }
  crop.draw(pen, '#7fd1ae');
  scene.draw(pen, '#ffd166');
  path.draw(pen, '#8fc4ff');
  measure.draw(pen, '#ffd166');
  pen.done();
}

const pixelAt = ({x, y}) => {
  const {camera, rect} = shown;
  return {camera, x: ((x - rect.x) / rect.width) * camera.width, y: ((y - rect.y) / rect.height) * camera.height};
};
async function pick(place) {
  const pixel = shown && pixelAt(place);
  if (!pixel || pixel.x < 0 || pixel.y < 0 || pixel.x >= pixel.camera.width || pixel.y >= pixel.camera.height) return null;
  try {
    return await ask({type: 'pick', ...pixel, ...view.settings}, 60);
  } catch (fault) {
    say(fault.message);
    return null;
  }
}
async function measureAt(place) {
  const found = await pick(place);
  if (found) measure.picked(found);
}
function measureChanged() {
  stage.classList.toggle('measuring', measure.active());
  $('crosshair').hidden = !measure.active();
  writeCommand();
  draw();
}
const writeCommand = () => hello && command.write(hello.model.name, view.crop, measure.factor());

const middle = () => ({x: stage.clientWidth / 2, y: stage.clientHeight / 2});
const keys = {
  o: () => setStyle('orbit'), f: () => setStyle('fly'), g: () => setStyle('walk'),
  r: () => $('reset').click(), l: () => view.level(), h: () => $('help').showModal(), '?': () => $('help').showModal(),
  k: () => path.add(), p: () => path.toggle(),
  m: () => measure.toggle(),
  Enter: () => measure.active() && measureAt(middle()),
  c: () => !$('compare').disabled && photo.show(!$('compare').checked),
  '[': () => list.next(-1), ']': () => list.next(1),
};
Object.keys(modes).forEach((name, i) => (keys[i + 1] = () => hello?.modes.includes(name) && setMode(name)));

const moving = (move) => (...given) => hello && (path.stop(), move(...given));
listenTo(stage, {
  turn: moving((turn) => view.turn(turn)),
  zoom: moving((factor) => view.zoom(factor)),
  shift: moving((pixels) => view.shift(pixels)),
  step: moving((step) => {
    if (view.style === 'orbit') setStyle('fly');
    view.step(step);
  }),
  grab: (place) => (measure.active() ? null : crop.grab(place) ?? scene.grab(place)),
  hover(place) {
    const over = measure.active() ? null : pointedAt(tips, place);
    stage.classList.toggle('pointing', over !== null);
    if (over !== pointed) pointed = over, draw();
  },
  tap(place) {
    if (!shown) return;
    if (measure.active()) return measureAt(place);
    const index = pointedAt(tips, place);
    if (index !== null) jump(cameras.find((c) => c.index === index));
  },
  async doubleTap(place) {
    if (measure.active()) return measureAt(place);
    const found = await pick(place);
    if (found?.hit) view.world.pivot = found.point, say('Turning about that point.');
  },
  key: (name) => (keys[name] ? (keys[name](), true) : false),
});

// ---- the controls

const panel = tabs($('tabs'), () => training?.draw());
const styleChoice = radios($('styles'), 'style', Object.fromEntries(Object.entries(styles).map(([k, s]) => [k, s.title])), setStyle);
const modeChoice = radios($('modes'), 'mode', Object.fromEntries(Object.entries(modes).map(([k, m]) => [k, m.title])), setMode);
function setStyle(style) {
  view.setStyle(style);
  styleChoice.set(style);
  aloud(styles[style].title);
}
// The error is that of a photograph: it takes a camera that has one.
function setMode(mode) {
  if (mode === 'error' && !view.through?.photo) {
    const seen = cameras.filter((c) => c.photo), far = (c) => norm(sub(poseOf(c.camera).place, view.pose.place));
    if (!seen.length) return modeChoice.set(view.mode);
    jump(seen.reduce((best, c) => (far(c) < far(best) ? c : best)));
  }
  view.mode = mode;
  modeChoice.set(mode);
  features.show(mode === 'features');
  view.changed();
  aloud(modes[mode].title);
}

const lens = lensPanel({lens: $('lens'), angle: $('angle'), angleRow: $('angle-row'), angleNow: $('angle-now')}, view);
const look = lookPanel({
  shapes: $('shapes'), opacity: $('opacity'), opacityNow: $('opacity-now'), size: $('splat-size'), sizeNow: $('splat-size-now'),
  background: $('background'), reset: $('look-reset'),
}, (moving) => {
  view.look = look.value();
  view.changed(moving);
});
const features = featurePanel({part: $('feature-choice'), kind: $('feature-kind'), places: $('feature-places')}, () => {
  view.features = features.value();
  view.changed();
});
imagePanel({width: $('image-width'), height: $('image-height'), like: $('image-like'), save: $('save-image')}, {
  size: () => view.stage,
  name: () => hello.model.name,
  image: (size) => ask({type: 'image', camera: view.camera('image', size), ...view.shown}, 3600).then((answer) => ({header: answer, file: answer.file})),
}, say);
const models = modelList({part: $('open-model'), list: $('models')}, (index, name) => {
  if (connection.send({type: 'model', index})) say(`Opening ${name} …`);
});
$('reset').addEventListener('click', () => (path.stop(), view.home(), lens.write(), aloud('Home')));
$('level').addEventListener('click', () => view.level());
$('save-pose').addEventListener('click', () => saveFile('camera.json', fromOrigin([view.camera()], origin())));
$('help-button').addEventListener('click', () => $('help').showModal());
$('show-frusta').addEventListener('change', draw);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => (training.draw(), draw()));

const photo = photoSplit(stage, $('photo'), $('divider'), $('compare'));
function jump(entry) {
  path.stop();
  view.lookThrough(entry);
  photo.through(entry);
  list.mark(entry.index);
  pointed = null;
  aloud(`Camera ${entry.name}${entry.test ? ', of the test views' : ''}`);
}
const list = cameraList({list: $('camera-list'), find: $('find'), previous: $('previous'), next: $('next')}, jump);

const crop = cropBox($('crop'), $('crop-on'), $('crop-reset'), () => {
  view.crop = crop.value();
  view.changed(true);
  writeCommand();
  draw();
});
const scene = scenePanel({
  list: $('scene-list'), none: $('scene-none'), part: $('scene-part'), material: $('material'), materialRow: $('material-row'),
  lightRows: $('light-rows'), strength: $('light-strength'), strengthNow: $('light-strength-now'), color: $('light-color'),
  place: $('scene-place'), ways: $('scene-ways'), onlooker: $('scene-onlooker'),
}, {send: (message) => connection.send(message), changed: (moving) => view.changed(moving), redraw: draw}, say);
fileDrop(stage, $('add-file'), () => (!hello?.scene ? 'gart view --scene opens a scene, this is a model' : hello.right === 'control' ? '' : 'this address may look, and not control'), say);
const command = commandPanel({part: $('export'), text: $('command'), copy: $('copy')}, say);
const measure = ruler({
  button: $('measure'), output: $('distance'), length: $('length'), scale: $('scale'), forget: $('forget-scale'),
}, say, measureChanged);

const path = keyframes({
  list: $('keys'), add: $('add-key'), play: $('play'), seconds: $('seconds'), closed: $('closed'), hint: $('path-hint'),
  saveKeys: $('save-keys'), savePath: $('save-path'), record: $('record'), load: $('load-keys'), timed: $('timed'), draw: $('draw-path'),
}, {
  camera: () => view.camera(),
  resized: (camera) => view.onStage(camera),
  show(camera, atRest) {
    view.show(camera, !atRest);
    lens.write();
  },
  redraw: draw,
  rest: () => view.changed(),
  ask: async (all, frames, closed, times) => (await ask({type: 'path', keyframes: all, frames, closed, times}, 120)).cameras,
  say,
  origin,
});
recorder($('record'), frame, {play: path.play, whole: atRest}, say);

const training = trainingPanel({
  progress: $('progress'), at: $('at-step'), rate: $('rate'), gaussians: $('gaussians'), pause: $('pause'), step: $('step'),
  save: $('save'), stop: $('stop'), sure: $('sure'), share: $('share'), shareNow: $('share-now'), onlooker: $('onlooker'),
  loss: $('loss-chart'), test: $('test-chart'), lossNow: $('loss-now'), testNow: $('test-now'),
}, (message) => connection.send(message), say);

styleChoice.set('orbit');
modeChoice.set('colour');
panel.choose(narrow() ? null : 'view');
