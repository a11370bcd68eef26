// What a reload keeps; times and the line of a path; thumbnails and scores of the cameras.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {linesOf, openPage} from './browser.mjs';
import {apart, placeOf} from './geometry.mjs';
import {onEach} from './screens.mjs';

const open = async (p, tab) => (await p.page.isVisible(`#panel-${tab}`)) || p.tab(tab);
const blue = (p) => linesOf(p.page, [143, 196, 255]);

async function threeKeys(p) {
  await open(p, 'path');
  for (const by of [[50, 0], [60, 10], [50, -10]]) {
    await p.drag([120, 100], by);
    await p.rest();
    await p.page.click('#add-key');
  }
}

export const kept = onEach({
  async 'a reload keeps pose, look, crop and keyframes'({browser, server}, screen) {
    const p = await openPage(browser, server.look, screen);
    await threeKeys(p);
    await open(p, 'tools');
    await p.page.check('#crop-on');
    await open(p, 'view');
    await p.page.check('#shapes input[value=ellipsoids]');
    await p.choose('depth');
    const before = (await p.rest()).view;
    await p.page.reload();
    await p.until('the page again', () => p.received.filter((m) => m.type === 'hello').length === 2);
    await p.until('the view again', () => p.last() !== before && p.views().length > 0);
    const after = (await p.rest()).view;
    for (const what of ['mode', 'shape', 'crop']) assert.deepEqual(after[what], before[what], what);
    assert.ok(after.camera.c2w.flat().every((x, i) => Math.abs(x - before.camera.c2w.flat()[i]) < 1e-9), 'the pose is another one');
    await open(p, 'path');
    assert.equal(await p.page.locator('#keys li').count(), 3);
    await p.close();
  },

  async 'keyframes have times, and their path is drawn'({browser, server}, screen) {
    const p = await openPage(browser, server.look, screen);
    await threeKeys(p);
    await p.drag([120, 100], [120, 40]);
    await p.page.mouse.move(150, 120);
    for (let i = 0; i < 5; ++i) await p.page.mouse.wheel(0, 600);
    await p.rest();
    await p.until('the line', async () => (await blue(p)) > 15);
    await p.page.uncheck('#draw-path');
    await p.until('no line', async () => (await blue(p)) === 0);
    await p.page.check('#draw-path');

    await p.page.fill('#seconds', '4');
    await p.page.check('#timed');
    const times = p.page.locator('#keys input');
    assert.deepEqual(await times.evaluateAll((all) => all.map((input) => Number(input.value))), [0, 2, 4]);
    await times.nth(1).fill('0.5');
    await p.page.keyboard.press('Enter');
    const asked = await p.until('the times', () => p.sent.findLast((m) => m.type === 'path' && m.times?.[1] === 0.5));
    assert.deepEqual(asked.times, [0, 0.5, 4]);
    await times.nth(1).fill('5');
    await p.page.keyboard.press('Enter');
    assert.equal(await times.nth(1).inputValue(), '0.5', 'a time after the next one is none');
    const saved = await p.saved(() => p.page.click('#save-path'));
    const cameras = JSON.parse(fs.readFileSync(await saved.path(), 'utf8'));
    assert.equal(cameras.length, 120);
    const keys = JSON.parse(fs.readFileSync(await (await p.saved(() => p.page.click('#save-keys'))).path(), 'utf8'));
    assert.deepEqual(keys.map((key) => key.time), [0, 0.5, 4]);
    const near = cameras.map((camera) => apart(placeOf(camera), placeOf(keys[1])));
    const at = near.indexOf(Math.min(...near)) * 4 / 119;
    assert.ok(Math.abs(at - 0.5) < 0.05, `it passes the second keyframe at ${at} s`);
    await p.close();
  },

  async 'cameras have thumbnails, and test views their scores'({browser, server, work}, screen) {
    const p = await openPage(browser, server.look, screen);
    const scores = new Map(JSON.parse(fs.readFileSync(path.join(work, 'run', 'metrics.json'))).views.map((v) => [v.name, v.psnr]));
    await p.tab('cameras');
    await p.until('a thumbnail', () => p.page.$eval('#camera-list img', (image) => image.complete && image.naturalWidth > 0));
    const rows = await p.page.locator('#camera-list .wide').evaluateAll((all) =>
      all.map((row) => ({name: row.querySelector('span').textContent, score: row.querySelector('small:last-child').textContent})));
    assert.equal(rows.length, 10);
    for (const {name, score} of rows) assert.equal(score, scores.has(name) ? `${scores.get(name).toFixed(2)} dB` : '');
    assert.equal(rows.filter(({score}) => score).length, 2);
    await p.close();
  },
});
