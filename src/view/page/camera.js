// gart's camera JSON (docs/cameras.md): made of a pose and a lens, and read from files.

import {kindOf} from './lens.js';
import {toRows, fromRows} from './pose.js';
import {sub} from './vector.js';

export const largestSide = 4096;

// The lenses that the page offers by name. angle: across the shorter side of the image, in degrees.
export const lenses = {
  pinhole: {title: 'Pinhole', least: 10, most: 140},
  fisheye: {title: 'Fisheye', least: 60, most: 360},
  sphere: {title: 'Whole sphere, 360°'},
};

// The camera of `lens` ({name, angle}, or {camera} of the capture) on a stage of that many pixels. The whole sphere and
// a capture's lens keep the shape of their image, as large as fits the stage.
export function cameraOf(pose, lens, stage, name = 'view') {
  const c2w = toRows(pose);
  if (lens.camera) return {...fitted(lens.camera, stage), name, c2w};
  if (lens.name === 'sphere') {
    const width = Math.max(2, 2 * Math.floor(Math.min(stage.width / 2, stage.height)));
    return {name, camera_model: 'EQUIRECTANGULAR', width, height: width / 2, c2w};
  }
  const {width, height} = stage, half = lens.angle * Math.PI / 360, radius = Math.min(width, height) / 2;
  const f = radius / (lens.name === 'pinhole' ? Math.tan(half) : half);
  const camera = {name, width, height, fx: f, fy: f, cx: width / 2, cy: height / 2, c2w};
  return lens.name === 'pinhole' ? camera : {...camera, camera_model: 'OPENCV_FISHEYE', k1: 0, k2: 0, k3: 0, k4: 0};
}

// The same camera with the largest image that fits; what is beside it of the stage stays empty.
export function fitted(camera, stage) {
  const s = Math.min(stage.width / camera.width, stage.height / camera.height);
  return resized(camera, Math.max(1, Math.round(camera.width * s)), Math.max(1, Math.round(camera.height * s)));
}

export function resized(camera, width, height) {
  const out = {...camera, width, height}, sx = width / camera.width, sy = height / camera.height;
  for (const [key, s] of [['fx', sx], ['cx', sx], ['fy', sy], ['cy', sy], ['f', sx]])
    if (key in out) out[key] *= s;
  return out;
}

// The angle across the shorter side of the stage at which a pinhole shows things as large as this camera does.
export function angleLike(camera, stage) {
  const focal = camera.fy ?? camera.f;
  if (!focal) return 60;
  const shown = fitted(camera, stage);
  const angle = 2 * Math.atan(Math.min(stage.width, stage.height) / 2 / (shown.fy ?? shown.f)) * 180 / Math.PI;
  return Math.min(lenses.pinhole.most, Math.max(lenses.pinhole.least, angle));
}

// The free lens for this camera: one that the page offers by name, or else the camera's own, which keeps the shape of
// its image.
export function lensLike(camera, stage) {
  const kind = kindOf(camera), bent = /^(k$|[kps][0-9x]|omega|alpha|beta)/;
  if (kind === 'sphere') return {name: 'sphere'};
  if (Object.entries(camera).some(([key, value]) => bent.test(key) && value !== 0)) return {camera};
  if (kind === 'perspective') return {name: 'pinhole', angle: angleLike(camera, stage)};
  if (kind !== 'fisheye') return {camera};
  const shown = fitted(camera, stage), angle = (Math.min(stage.width, stage.height) / (shown.fy ?? shown.f)) * 180 / Math.PI;
  return {name: 'fisheye', angle: Math.min(lenses.fisheye.most, Math.max(lenses.fisheye.least, angle))};
}

export const poseOf = (camera) => fromRows(camera.c2w);

// What a file has of cameras that are from the scene's origin.
export const fromOrigin = (cameras, origin) => (origin.some((x) => x !== 0) ? cameras.map((camera) => ({...camera, origin})) : cameras);

// The cameras of a file, from the scene's origin; else an Error naming the camera and the field.
export function readCameras(text, origin) {
  let list;
  try {
    list = JSON.parse(text);
  } catch (fault) {
    throw new Error(`The file is not JSON: ${fault.message}`);
  }
  if (!Array.isArray(list) || list.length === 0) throw new Error('The file holds no list of cameras.');
  const poses = ['c2w', 'c2w_end'];
  const numbers = (values, n) => Array.isArray(values) && values.length === n && values.every(Number.isFinite);
  list.forEach((camera, i) => {
    const fail = (what) => {
      throw new Error(`Camera ${i}: ${what}.`);
    };
    if (typeof camera !== 'object' || camera === null) fail('is not an object');
    for (const key of ['width', 'height'])
      if (!Number.isInteger(camera[key]) || camera[key] < 1) fail(`${key} is no whole number above 0`);
    for (const key of poses) {
      const rows = camera[key];
      if (key !== 'c2w' && rows === undefined) continue;
      if (!Array.isArray(rows) || rows.length < 3 || !rows.slice(0, 3).every((row) => numbers(row, 4)))
        fail(`${key} is not rows of 4 numbers`);
    }
    if (camera.origin !== undefined && !numbers(camera.origin, 3)) fail('origin is not a list of 3 numbers');
    const needed = camera.camera_model === 'EQUIRECTANGULAR' ? [] : ['fx', 'fy', 'cx', 'cy'];
    for (const key of needed) if (!Number.isFinite(camera[key])) fail(`${key} is no number`);
  });
  return list.map(({origin: own = [0, 0, 0], ...camera}) => {
    const shift = sub(own, origin);  // by origins first: what is alike in both then leaves no rounding
    const moved = (rows) => rows.map((row, i) => (i < 3 ? [...row.slice(0, 3), row[3] + shift[i]] : row));
    for (const key of poses) if (camera[key]) camera[key] = moved(camera[key]);
    return camera;
  });
}
