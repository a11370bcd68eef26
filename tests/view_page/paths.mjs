// Keyframes: added, replayed, saved, loaded again; and a video.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {openPage, psnr} from './browser.mjs';
import {apart, isRotation, placeOf} from './geometry.mjs';

const read = async (download) => JSON.parse(fs.readFileSync(await download.path(), 'utf8'));

// The size and the length of a video, by the browser that plays it to its end.
async function played(browser, bytes, kind) {
  const page = await browser.newPage();
  const seen = await page.evaluate((source) => new Promise((resolve, reject) => {
    const video = Object.assign(document.createElement('video'), {muted: true, src: source});
    video.onerror = () => reject(new Error(video.error.message));
    video.onended = () => resolve({width: video.videoWidth, height: video.videoHeight, seconds: video.currentTime});
    video.play().catch(reject);
  }), `data:video/${kind};base64,${bytes.toString('base64')}`);
  await page.close();
  return seen;
}

export const paths = {
  async 'keyframes make a path, which plays, is saved, and comes back'({browser, server, gart, work}) {
    const p = await openPage(browser, server.control, {viewport: {width: 800, height: 420}});
    await p.tab('path');
    const keys = [];
    for (const by of [[60, 0], [70, 20], [50, -30]]) {
      await p.drag([200, 200], by);
      keys.push((await p.rest()).view.camera);
      await p.page.click('#add-key');
    }
    assert.equal(await p.page.locator('#keys li').count(), 3);
    await p.page.fill('#seconds', '0.6');
    const before = p.views().length;
    await p.page.click('#play');
    await p.until('the replay to begin', async () => (await p.page.textContent('#play')) === 'Stop');
    // Others are for the line in the view.
    const asked = await p.until('the question', () => p.sent.find((m) => m.type === 'path' && m.frames === 18));
    const {cameras} = await p.until('the path', () => p.received.find((m) => m.type === 'path' && m.id === asked.id));
    assert.equal(cameras.length, 18);
    assert.ok(cameras.every((camera) => isRotation(camera, 1e-6)));
    assert.ok(apart(placeOf(cameras[0]), placeOf(keys[0])) < 1e-5);
    assert.ok(apart(placeOf(cameras.at(-1)), placeOf(keys[2])) < 1e-5);
    assert.ok(Math.min(...cameras.map((c) => apart(placeOf(c), placeOf(keys[1])))) < 0.12, 'it passes the second');
    await p.until('the replay to end', async () => (await p.page.textContent('#play')) === 'Play' && !p.last().moving);
    const {view} = await p.rest();
    assert.ok(apart(placeOf(view.camera), placeOf(keys[2])) < 1e-5, 'it ends at the last keyframe');
    const played = p.views().slice(before).map((v) => placeOf(v.camera));
    assert.ok(played.filter((at) => keys.every((key) => apart(at, placeOf(key)) > 1e-6)).length >= 3, 'it shows what is between');

    const saved = await read(await p.saved(() => p.page.click('#save-keys')));
    assert.equal(saved.length, 3);
    saved.forEach((camera, i) => assert.ok(apart(placeOf(camera), placeOf(keys[i])) < 1e-9));
    fs.writeFileSync(path.join(work, 'path.json'), JSON.stringify(await read(await p.saved(() => p.page.click('#save-path')))));
    assert.equal(JSON.parse(fs.readFileSync(path.join(work, 'path.json'))).length, 18);
    fs.writeFileSync(path.join(work, 'few.json'), JSON.stringify(JSON.parse(fs.readFileSync(path.join(work, 'path.json'))).slice(0, 2)));
    await gart.run('render', 'run/model.ply', 'few.json', '--out', 'path', '--backend', 'openmp', '--quiet');
    assert.equal(fs.readdirSync(path.join(work, 'path')).filter((file) => file.endsWith('.png')).length, 2);

    for (let left = 3; left > 0; --left) await p.page.click('#keys li:first-child button:last-child');
    assert.equal(await p.page.locator('#keys li').count(), 0);
    const file = (name, text) => ({name, mimeType: 'application/json', buffer: Buffer.from(text)});
    await p.page.setInputFiles('#load-keys', file('keys.json', JSON.stringify(saved)));
    await p.until('the keyframes', async () => (await p.page.locator('#keys li').count()) === 3);
    await p.page.click('#keys li:nth-child(2) .wide');
    await p.until('the second keyframe', () => apart(placeOf(p.last().camera), placeOf(keys[1])) < 1e-9);
    for (const [text, what] of [['{', 'not JSON'], ['[{"width": 3}]', 'Camera 0: height'], ['[]', 'no list']]) {
      await p.page.setInputFiles('#load-keys', file('bad.json', text));
      await p.until(what, async () => (await p.page.textContent('#say')).includes(what));
    }
    assert.equal(await p.page.locator('#keys li').count(), 3, 'a bad file changes nothing');
    await p.close();
  },

  async 'keyframes of a model from an origin are the capture\'s own'({browser, gart, work}) {
    const origin = [500000, 4000000, 100];
    await gart.run('convert', 'run/model.ply', 'far.ply', '--origin', origin.join(), '--quiet');
    const server = await gart.serve('view', 'far.ply', '--backend', 'openmp');
    const p = await openPage(browser, server.control, {viewport: {width: 800, height: 420}});
    await p.tab('path');
    const {camera} = (await p.rest()).view;
    assert.equal(camera.origin, undefined, 'gart is told of places from the origin');
    await p.page.click('#add-key');
    const [saved] = await read(await p.saved(() => p.page.click('#save-keys')));
    assert.deepEqual(saved.origin, origin);
    assert.ok(apart(placeOf(saved), placeOf(camera)) < 1e-9);
    // As poses.json has it: the whole place in the pose.
    const {origin: _, ...whole} = {...saved, c2w: saved.c2w.map((row, i) => (i < 3 ? [...row.slice(0, 3), row[3] + origin[i]] : row))};
    for (const [i, one] of [saved, whole].entries()) {
      await p.drag([200, 200], [60, 0]);
      await p.page.setInputFiles('#load-keys', {name: `own${i}.json`, mimeType: 'application/json', buffer: Buffer.from(JSON.stringify([one]))});
      await p.until('the keyframe', async () => (await p.page.textContent('#say')).includes(`1 keyframes from own${i}.json`));
      await p.page.click('#keys li:first-child .wide');
      await p.until('its place', () => apart(placeOf(p.last().camera), placeOf(camera)) < 1e-6);
    }
    await p.close();
    for (const [model, out, one] of [['far.ply', 'far', saved], ['run/model.ply', 'near', camera]]) {
      fs.writeFileSync(path.join(work, 'keys.json'), JSON.stringify([{...one, name: 'key'}]));
      await gart.run('render', model, 'keys.json', '--out', out, '--background', 'black', '--backend', 'openmp', '--quiet');
    }
    const [far, near] = ['far', 'near'].map((out) => fs.readFileSync(path.join(work, out, 'key.png'))), alike = await psnr(browser, far, near);
    assert.ok(alike > 50, `${alike} dB`);
    server.child.kill('SIGINT');
    await server.ended;
  },

  async 'a video of the path is recorded'({browser, server}) {
    const p = await openPage(browser, server.control, {viewport: {width: 800, height: 420}});
    await p.tab('path');
    await p.page.click('#add-key');
    await p.drag([200, 200], [90, 0]);
    await p.page.click('#add-key');
    await p.page.fill('#seconds', '0.8');
    const downloads = [];
    p.page.on('download', (download) => downloads.push(download));
    await p.page.click('#record');
    await p.until('the recorder to end', async () => (await p.page.getAttribute('#record', 'aria-pressed')) === 'false');
    const said = await p.page.textContent('#say');
    assert.equal(said, 'The video is saved.');
    await p.until('the file', () => downloads.length === 1);
    const [video] = downloads;
    const bytes = fs.readFileSync(await video.path());
    const webm = bytes.readUInt32BE(0) === 0x1a45dfa3, mp4 = bytes.subarray(4, 8).toString() === 'ftyp';
    assert.ok(webm || mp4, 'no video file');
    // It has frames, of the canvas's size, and the path takes the time that it is to take.
    const [width, height] = p.frames.at(-1).header.full, seen = await played(browser, bytes, webm ? 'webm' : 'mp4');
    assert.deepEqual([seen.width, seen.height], [width, height]);
    assert.ok(seen.seconds > 0.5, `${seen.seconds} s`);
    await p.close();
  },
};
