// What the page shows is what gart renders: at rest, through several lenses, in every mode.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {openPage, psnr} from './browser.mjs';

// JPEG at quality 95 of such images keeps about 40 dB; another camera, size or lens keeps less than 25.
const sameImage = 34;

export const images = {
  async 'a frame at rest is what gart render makes of its camera, through each lens'({browser, server, gart, work}) {
    const p = await openPage(browser, server.control, {viewport: {width: 800, height: 420}});
    const frames = [];
    for (const lens of ['pinhole', 'fisheye', 'sphere']) {
      await p.page.selectOption('#lens', lens);
      const frame = await p.rest();
      assert.equal(frame.view.camera.camera_model, {fisheye: 'OPENCV_FISHEYE', sphere: 'EQUIRECTANGULAR'}[lens]);
      assert.deepEqual([frame.header.width, frame.header.height], [frame.view.camera.width, frame.view.camera.height]);
      frames.push({...frame, name: lens});
    }
    fs.writeFileSync(path.join(work, 'seen.json'), JSON.stringify(frames.map((f) => ({...f.view.camera, name: f.name}))));
    const background = p.received[0].background[0] > 0.5 ? 'white' : 'black';
    await gart.run('render', 'run/model.ply', 'seen.json', '--out', 'seen', '--backend', 'openmp', '--background', background, '--quiet');
    for (const {name, jpeg} of frames) {
      const value = await psnr(browser, jpeg, fs.readFileSync(path.join(work, 'seen', `${name}.png`)));
      console.log(`           ${name}: ${value.toFixed(1)} dB`);
      assert.ok(value > sameImage, `${name}: ${value} dB`);
    }
    const other = await psnr(browser, frames[0].jpeg, fs.readFileSync(path.join(work, 'seen', 'fisheye.png')));
    assert.ok(other < 25, `a wrong image would pass: ${other} dB`);
    await p.close();
  },

  async 'every mode is shown, and its legend says what its colours are'({browser, server}) {
    const p = await openPage(browser, server.control, {viewport: {width: 800, height: 420}});
    assert.deepEqual(p.received[0].modes, ['colour', 'depth', 'normal', 'alpha', 'hits', 'error']);
    await p.tab('view');
    const seen = new Map();
    for (const mode of p.received[0].modes) {
      await p.choose(mode);
      const {header, jpeg, view} = await p.rest();
      assert.equal(header.mode, mode);
      assert.equal(view.mode, mode);
      for (const [other, bytes] of seen) assert.ok(!jpeg.equals(bytes), `${mode} looks like ${other}`);
      seen.set(mode, jpeg);
      await p.until('the legend', async () => (await p.page.isVisible('#legend')) === (mode !== 'colour'));
      if (['depth', 'hits', 'error'].includes(mode)) {
        const [low, high] = await Promise.all(['from', 'to'].map((c) => p.page.textContent(`#legend .${c}`)));
        assert.ok(Math.abs(Number(low) - header.scale[0]) <= 0.01 * header.scale[1] + 0.5 * (mode === 'hits'), `${low}`);
        assert.ok(Math.abs(Number(high) - header.scale[1]) <= 0.01 * header.scale[1] + 0.5 * (mode === 'hits'), `${high}`);
        assert.ok(header.scale[1] > header.scale[0]);
      }
    }
    // The error is that of a photograph: the page went to a camera that has one, and leaves the mode with it.
    assert.equal(typeof p.last().photo, 'number');
    await p.drag([200, 200], [40, 0]);
    const {view} = await p.rest();
    assert.equal(view.mode, 'colour');
    assert.equal(await p.page.isChecked('#modes input[value=colour]'), true);
    await p.close();
  },
};
