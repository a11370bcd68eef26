// What is looked at: pose, lens, mode, look and crop, told to gart as they change. While a hand moves the camera gart may trace
// fewer pixels; a moment after the last motion it is asked for all of them.

import {angleLike, cameraOf, largestSide, lenses, lensLike, poseOf} from './camera.js';
import {kindOf} from './lens.js';
import {lookingAt} from './pose.js';
import {add, scale} from './vector.js';
import {levelled, pivotAhead, shifted, styles} from './navigation.js';

const restAfter = 150;    // milliseconds without a motion
const sendEvery = 15;     // at least, between two views: each time that a screen is drawn anew
const mostWaiting = 1e5;  // bytes that have not left the browser

export class View {
  style = 'orbit';
  mode = 'colour';
  crop = null;
  look = {};  // as look.js has it
  features = null;  // as features.js has them
  lens = {name: 'pinhole', angle: 60};
  through = null;  // the camera of the capture that is looked through
  stage = {width: 2, height: 2, cssWidth: 2, cssHeight: 2};
  world = {pivot: [0, 0, 0], up: [0, 0, 1], extent: 1, speed: 0.35};

  #id = 0;
  #shownId = 0;
  #sent = new Map();
  #dirty = false;
  #moving = false;
  #movedAt = -1e9;
  #sentAt = -1e9;
  #wanted = false;

  // connection: as connect() makes it. left(): the view no longer looks through a camera of the capture. late(): what is
  // shown is no longer what is wanted.
  constructor(connection, left, late) {
    this.connection = connection;
    this.left = left;
    this.late = late;
    this.pose = lookingAt([0, -2, 0], [0, 0, 0], this.world.up);
  }

  // state: as state() gave it for this model, where the page was here before.
  start({model, cameras}, state) {
    const extent = model.extent > 0 ? model.extent : 1;
    this.centre = model.center;
    this.world = {pivot: model.center, up: model.up, extent, speed: 0.35 * extent};
    this.first = cameras[0]?.camera ?? null;
    this.through = null;
    if (!state) return this.home();
    this.pose = state.pose, this.lens = state.lens, this.world.pivot = state.pivot;
    this.changed();
  }
  state() {
    return {pose: this.pose, lens: this.lens, pivot: this.world.pivot, through: this.through?.index ?? null};
  }

  // The start view: the capture’s first camera, or from aside and above, with the whole scene in view.
  home() {
    this.leave();
    const {up, extent} = this.world;
    if (this.first) {
      this.pose = poseOf(this.first);
      this.lens = {name: 'pinhole', angle: kindOf(this.first) === 'perspective' ? angleLike(this.first, this.stage) : 75};
    } else {
      const side = Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
      this.pose = lookingAt(add(this.centre, add(scale(side, 2.1 * extent), scale(up, extent))), this.centre, up);
      this.lens = {name: 'pinhole', angle: 60};
    }
    this.world.pivot = pivotAhead(this.pose, this.centre, extent);
    this.changed();
  }

  resize(cssWidth, cssHeight, ratio) {
    const fit = Math.min(ratio, largestSide / Math.max(cssWidth, cssHeight));
    const pixels = (x) => Math.max(2, Math.round(x * fit));
    this.stage = {width: pixels(cssWidth), height: pixels(cssHeight), cssWidth, cssHeight};
    this.changed();
  }

  camera(name, stage = this.stage) {
    return cameraOf(this.pose, this.through ? {camera: this.through.camera} : this.lens, stage, name);
  }

  // How it differs from the model, as messages have it.
  get settings() {
    return {...this.look, crop: this.crop};
  }
  // With the photograph that the mode is of.
  get shown() {
    const photo = this.through?.photo ? this.through.index : null;
    const features = this.mode === 'features' ? {features: this.features} : {};
    return {mode: this.mode === 'error' && photo === null ? 'colour' : this.mode, photo, ...features, ...this.settings};
  }

  // Where a camera's image lies on the stage, in CSS pixels.
  rectOf(camera) {
    const s = this.stage.cssWidth / this.stage.width;
    const width = camera.width * s, height = camera.height * s;
    return {x: (this.stage.cssWidth - width) / 2, y: (this.stage.cssHeight - height) / 2, width, height};
  }

  // A camera's image at the size of the stage: what the page's own lenses show fills it.
  onStage(camera) {
    return cameraOf(poseOf(camera), lensLike(camera, this.stage), this.stage);
  }

  lookThrough(entry) {
    this.through = entry;
    this.pose = poseOf(entry.camera);
    this.world.pivot = pivotAhead(this.pose, this.centre, this.world.extent);
    this.changed();
  }

  // A camera of a path or a file.
  show(camera, moving) {
    this.leave();
    this.pose = poseOf(camera);
    this.lens = lensLike(camera, this.stage);
    this.changed(moving);
  }

  // The free camera that shows what the capture's did, so that nothing jumps.
  leave() {
    const entry = this.through;
    if (!entry) return;
    this.through = null;
    this.lens = kindOf(entry.camera) === 'perspective'
      ? {name: 'pinhole', angle: angleLike(entry.camera, this.stage)}
      : lensLike(entry.camera, this.stage);
    this.left();
  }

  turn(turn) {
    this.#move(styles[this.style].turn(this.pose, turn, this.world));
  }
  zoom(factor) {
    this.#move(styles[this.style].zoom(this.pose, factor, this.world));
  }
  step(step) {
    this.#move(styles[this.style].step(this.pose, step, this.world));
  }
  shift([dx, dy]) {
    const camera = this.camera(), rect = this.rectOf(camera);
    const focal = camera.fy ? camera.fy * rect.height / camera.height : rect.width / (2 * Math.PI);
    const next = shifted(this.pose, [dx / focal, dy / focal], this.world);
    this.world.pivot = next.pivot;
    this.#move(next.pose);
  }
  level() {
    this.#move(levelled(this.pose, this.world.up));
  }
  setStyle(style) {
    this.style = style;
    if (style === 'orbit') this.world.pivot = pivotAhead(this.pose, this.centre, this.world.extent);
    else if (style === 'walk') this.level();
  }
  setLens(lens) {
    this.leave();
    this.lens = lens;
    this.changed();
  }
  get offered() {
    return this.lens.camera ? null : lenses[this.lens.name];
  }

  #move(pose) {
    this.leave();
    this.pose = pose;
    this.changed(true);
  }

  changed(moving = false) {
    this.#dirty = true;
    this.late();
    if (moving) this.#moving = true, this.#movedAt = performance.now();
    if (!this.#wanted) this.#wanted = true, requestAnimationFrame(() => this.#tick());
  }

  #tick() {
    this.#wanted = false;
    const now = performance.now();
    if (this.#moving && now - this.#movedAt > restAfter) this.#moving = false, this.#dirty = true;
    if (this.#dirty && now - this.#sentAt >= sendEvery && this.connection.waiting() < mostWaiting) this.#send(now);
    if (this.#dirty || this.#moving) this.#wanted = true, requestAnimationFrame(() => this.#tick());
  }

  #send(now) {
    const camera = this.camera(), id = ++this.#id;
    this.#dirty = false;
    this.#sentAt = now;
    const sent = this.connection.send({type: 'view', id, camera, moving: this.#moving, ...this.shown});
    if (sent) this.#sent.set(id, {camera, pose: this.pose, rect: this.rectOf(camera), through: this.through, features: this.features});
  }

  // Whether the frame of that number is the newest wanted one.
  upTo(id) {
    return !this.#moving && !this.#dirty && id === this.#id;
  }

  // The same again, once what was asked for last is there.
  refresh() {
    if (this.upTo(this.#shownId)) this.changed();
  }

  // What a frame was asked for with; those before it are forgotten.
  asked(id) {
    this.#shownId = id;
    for (const old of this.#sent.keys()) if (old < id) this.#sent.delete(old);
    return this.#sent.get(id);
  }
}
