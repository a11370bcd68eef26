// A scene of meshes and lights among the Gaussians: traced by samples that add up, and changed by hand.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {linesOf, openPage, psnr} from './browser.mjs';
import {along, minus, pixelOf, splatPly} from './geometry.mjs';
import {onEach} from './screens.mjs';

const samples = 2;
// Cases that change the scene wait for each image, so theirs are traced by one sample.
const oneSample = {samples: 1, bounces: 1};
const description = {
  models: [{file: 'among.ply'}],
  meshes: [{name: 'ball', shape: 'sphere', scale: 0.4}, {name: 'floor', shape: 'plane', translation: [0, 1, 0], scale: 2}],
  lights: [{name: 'lamp', kind: 'point', position: [0.5, -2, -1], color: [8, 8, 8]}],
  options: {samples, bounces: 2, tone_map: 'srgb'},
};

// Paths cost by the pixel: the desk has a smaller window here.
const smaller = (screen) => (screen.isMobile ? screen : {viewport: {width: 900, height: 600}});

async function serve({gart, work}, options) {
  // Each twice: the bounds leave out the last in a hundred.
  const balls = [[-1, 0, 0, 0.2, [0.9, 0.2, 0.2]], [1, 0.3, 0.4, 0.25, [0.2, 0.6, 0.9]], [0, -1, 0, 0.15, [0.3, 0.8, 0.3]]];
  fs.writeFileSync(path.join(work, 'among.ply'), splatPly([...balls, ...balls]));
  fs.writeFileSync(path.join(work, 'scene.json'), JSON.stringify({...description, options: {...description.options, ...options}}));
  return gart.serve('view', '--scene', 'scene.json', '--backend', 'openmp');
}
async function end(server) {
  server.child.kill('SIGTERM');
  assert.equal(await server.ended, 0);
}

// A page whose list has the ball chosen; at(): where the stage shows a point.
async function openBall(world, screen) {
  const server = await serve(world, oneSample);
  const p = await openPage(world.browser, server.control, smaller(screen));
  await p.tab('scene');
  await p.page.click('#scene-list button:has-text("ball")');
  await p.until('the box about it', async () => (await linesOf(p.page, [255, 209, 102])) > 100);
  const {view: {camera}} = await p.rest(), {model, scene: [ball]} = p.received[0];
  const stage = await p.page.locator('#stage').boundingBox();
  const at = (point) => pixelOf(camera, point).slice(0, 2).map((x) => (x * stage.width) / camera.width);
  return {server, p, camera, model, ball, at};
}
// The scene's file, saved from a panel that shows all its width.
async function savedScene(p) {
  assert.equal(await p.page.$eval('#panel-scene', (panel) => panel.scrollWidth - panel.clientWidth), 0);
  return JSON.parse(fs.readFileSync(await (await p.saved(() => p.page.click('#save-scene'))).path()));
}

const traced = {
  async 'a scene is path traced: a draft as it moves, samples that add up at rest'(world) {
    const server = await serve(world), {browser, gart, work} = world;
    const p = await openPage(browser, server.look, {viewport: {width: 520, height: 300}});
    assert.deepEqual(p.received[0].modes, ['colour', 'depth', 'normal', 'alpha']);
    assert.deepEqual(p.received[0].scene.map((one) => one.name), ['ball', 'floor', 'lamp']);
    const {header, view, jpeg} = await p.rest();
    assert.deepEqual(header.samples, [samples, samples]);
    assert.equal(await p.page.textContent('#fps'), `${samples} of ${samples} samples`);
    const grown = p.frames.filter((f) => f.header.id === header.id).map((f) => f.header.samples[0]);
    assert.deepEqual(grown, [...grown].sort((a, b) => a - b));
    fs.writeFileSync(path.join(work, 'lit.json'), JSON.stringify([{...view.camera, name: 'lit'}]));
    await gart.run('render', '--scene', 'scene.json', 'lit.json', '--out', 'lit', '--backend', 'openmp', '--quiet');
    const value = await psnr(browser, jpeg, fs.readFileSync(path.join(work, 'lit', 'lit.png')));
    console.log(`           ${value.toFixed(1)} dB`);
    assert.ok(value > 32, `${value} dB`);
    const before = p.frames.length;
    await p.drag([150, 150], [60, 0]);
    await p.rest();
    const drafts = p.frames.slice(before).filter((f) => !f.header.still && f.header.width < f.header.full[0]);
    assert.ok(drafts.every((f) => f.header.samples[0] === 1));
    for (const mode of ['depth', 'normal', 'alpha']) {
      await p.choose(mode);
      assert.equal((await p.rest()).header.mode, mode);
    }
    await p.close();
    await end(server);
  },
};

const changed = onEach({
  async 'a mesh is moved by its handle and made a mirror, a light is dimmed, the scene is saved'(world, screen) {
    const {browser, work} = world, {server, p, camera, model, ball, at} = await openBall(world, screen);
    // The handle that goes farthest over the screen.
    const reach = (k) => 0.14 * model.extent + (ball.max[k] - ball.min[k]) / 2;
    const tip = (k, more = 0) => ball.place.map((x, i) => (i === k ? x + reach(k) + more : x));
    const way = (k) => minus(at(tip(k, 0.02)), at(tip(k))).map((x) => x / 0.02), far = (k) => Math.hypot(...way(k));
    const k = [0, 1, 2].reduce((best, i) => (far(i) > far(best) ? i : best));
    await p.drag(at(tip(k)), way(k).map((x) => 0.3 * x));
    const moved = await p.until('the scene to say so', () => p.received.filter((m) => m.type === 'scene').map((m) => m.parts[0].place)
      .find((place) => Math.abs(place[k] - ball.place[k] - 0.3) < 0.05));
    moved.forEach((x, i) => i === k || assert.ok(Math.abs(x - ball.place[i]) < 1e-4, 'it moved along one axis'));
    const still = await p.rest();
    assert.deepEqual(still.view.camera, camera, 'the camera moved with the handle');

    await p.page.selectOption('#material', 'mirror');
    await p.until('a mirror', () => p.received.some((m) => m.type === 'scene' && m.parts[0].kind === 'mirror'));
    const mirror = await p.rest();
    assert.ok(!mirror.jpeg.equals(still.jpeg));
    await p.page.screenshot({path: path.join(work, `scene-mesh-${screen.viewport.width}.png`)});

    await p.page.click('#scene-list button:has-text("lamp")');
    assert.equal(await p.page.textContent('#light-strength-now'), '8');
    await p.page.$eval('#light-strength', (input) => {
      input.value = 1;
      input.dispatchEvent(new Event('input', {bubbles: true}));
    });
    await p.page.fill('#light-color', '#ff0000');
    await p.until('a dim red lamp', () => p.received.some((m) => m.type === 'scene' && String(m.parts[2].color) === '2,0,0'));
    assert.ok(!(await p.rest()).jpeg.equals(mirror.jpeg));
    await p.page.screenshot({path: path.join(work, `scene-light-${screen.viewport.width}.png`)});

    const file = await savedScene(p);
    assert.ok(Math.abs(file.meshes[0].translation[k] - moved[k]) < 0.05);
    assert.equal(file.materials.find((m) => m.name === file.meshes[0].material).kind, 'mirror');
    assert.deepEqual(file.lights[0].color, [2, 0, 0]);
    assert.deepEqual(file.models, description.models);
    await p.close();

    const onlooker = await openPage(browser, server.look, smaller(screen));
    await onlooker.tab('scene');
    assert.equal(await onlooker.page.isVisible('#scene-onlooker'), true);
    await onlooker.page.click('#scene-list button:has-text("ball")');
    assert.equal(await onlooker.page.isDisabled('#material'), true);
    await onlooker.close();
    await end(server);
  },
});

const turned = onEach({
  async 'a mesh is turned and made larger by its handles, the scene is saved'(world, screen) {
    const {work} = world, {server, p, camera, model, ball, at} = await openBall(world, screen);
    assert.deepEqual([ball.rotation, ball.scale], [[1, 0, 0, 0], [0.4, 0.4, 0.4]]);
    const way = (from, to, times) => minus(at(along(from, minus(to, from), 0.02)), at(from)).map((x) => (times * x) / 0.02);
    const part = () => p.received.filter((m) => m.type === 'scene').at(-1)?.parts[0] ?? ball;
    const near = (a, b, within) => a.every((x, i) => Math.abs(x - b[i]) < within);

    // The ring whose handle goes farthest over the screen, by half a radian.
    await p.page.click('#scene-ways label:has-text("Turn")');
    const radius = 0.14 * model.extent + (ball.max[0] - ball.min[0]) / 2, half = radius / Math.SQRT2;
    const on = (k, ahead) => ball.place.map((x, i) => x + (i === k ? 0 : i === (k + 1) % 3 ? half - ahead : half + ahead));
    const length2 = (v) => v[0] ** 2 + v[1] ** 2, step = 0.5 * half;
    const ring = [0, 1, 2].map((k) => way(on(k, 0), on(k, step), 1));
    const k = [0, 1, 2].reduce((best, i) => (length2(ring[i]) > length2(ring[best]) ? i : best));
    await p.drag(at(on(k, 0)), ring[k]);
    const quarter = [0, 1, 2, 3].map((i) => (i === 0 ? Math.cos(0.25) : i === k + 1 ? Math.sin(0.25) : 0));
    await p.until('the scene to say that it turned', () => near(part().rotation, quarter, 0.03));
    assert.ok(near(part().place, ball.place, 0.01), 'it turned about its middle');
    assert.deepEqual((await p.rest()).view.camera, camera, 'the camera moved with the handle');
    await p.page.screenshot({path: path.join(work, `scene-turn-${screen.viewport.width}.png`)});

    await p.page.click('#scene-ways label:has-text("Resize")');
    const before = await p.rest(), now = part();
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((j) => (i >> j & 1 ? now.max[j] : now.min[j])));
    const far = (corner) => length2(minus(at(corner), at(now.place)));
    const corner = corners.reduce((best, one) => (far(one) > far(best) ? one : best));
    const out = minus(corner, now.place);  // from the middle to the handle
    await p.drag(at(corner), way(corner, along(corner, out, 1), 0.5));
    await p.until('the scene to say that it grew', () => near(part().scale, [0.6, 0.6, 0.6], 0.02));
    assert.ok(near(part().place, now.place, 0.01), 'it grew about its middle');
    assert.ok(!(await p.rest()).jpeg.equals(before.jpeg));
    await p.page.screenshot({path: path.join(work, `scene-size-${screen.viewport.width}.png`)});

    const file = await savedScene(p);
    assert.ok(near(file.meshes[0].rotation, part().rotation, 1e-6) && near(file.meshes[0].scale, part().scale, 1e-6));
    assert.equal(file.meshes[1].rotation, undefined);
    await p.page.click('#scene-list button:has-text("lamp")');
    assert.equal(await p.page.isVisible('#scene-ways'), false);
    await p.close();
    await end(server);
  },
});

const added = onEach({
  async 'a mesh that is dropped or chosen is in the scene, what is wrong is said'(world, screen) {
    const server = await serve(world, oneSample), {browser} = world;
    const p = await openPage(browser, server.control, smaller(screen));
    await p.tab('scene');
    const said = (part) => p.until(`"${part}"`, async () => (await p.page.textContent('#say')).includes(part));
    const drop = (name, text) => p.page.evaluate(([file, content]) => {
      const data = new DataTransfer();
      data.items.add(new File([content], file));
      document.getElementById('stage').dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}));
    }, [name, text]);
    const before = await p.rest();
    await drop('wedge one.obj', 'v -1 -1 0\nv 1 -1 0\nv 0 -2 0\nf 1 2 3\nf 3 2 1\n');
    await said('wedge one.obj is in the scene');
    await p.page.waitForSelector('#scene-list button:has-text("wedge one")');
    await p.until('another image', async () => !(await p.rest()).jpeg.equals(before.jpeg));
    await p.page.setInputFiles('#add-file', {name: 'again.obj', mimeType: 'text/plain', buffer: Buffer.from('v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n')});
    await said('again.obj is in the scene');
    await p.until('five parts', async () => (await p.page.locator('#scene-list li').count()) === 5);
    await drop('broken.obj', 'v 0 0\nf 1 2 3\n');
    await said('broken.obj could not be added');
    await drop('notes.txt', 'hello');
    await said('notes.txt: a scene takes');
    const file = JSON.parse(fs.readFileSync(await (await p.saved(() => p.page.click('#save-scene'))).path()));
    assert.deepEqual(file.meshes.slice(2).map((m) => m.file), ['wedge one.obj', 'again.obj']);
    await p.close();
    const status = await fetch(`${server.look}add/a.obj`, {method: 'POST', body: 'v 0 0 0', headers: {origin: new URL(server.look).origin}});
    assert.equal(status.status, 403);
    await end(server);
  },
});

export const scene = {...traced, ...changed, ...turned, ...added};
