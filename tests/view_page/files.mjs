// What leaves the page: images of any size, the command that writes the crop; and other models that come in.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {linesOf, openPage, psnr} from './browser.mjs';
import {apart, pixelOf, placeOf, splatPly} from './geometry.mjs';
import {onEach} from './screens.mjs';

const open = async (p, tab) => (await p.page.isVisible(`#panel-${tab}`)) || p.tab(tab);

// The means of a binary splat PLY, whose first properties are x, y, z.
function meansOf(file) {
  const bytes = fs.readFileSync(file), head = bytes.subarray(0, bytes.indexOf('end_header\n') + 11);
  const text = head.toString(), n = Number(text.match(/element vertex (\d+)/)[1]);
  const stride = 4 * text.match(/property float /g).length;
  assert.match(text, /property float x\nproperty float y\nproperty float z\n/);
  return Array.from({length: n}, (_, i) => [0, 1, 2].map((k) => bytes.readFloatLE(head.length + i * stride + 4 * k)));
}

export const files = onEach({
  async 'an image of any size is what gart render writes'({browser, server, gart, work}, screen) {
    const p = await openPage(browser, server.look, screen);
    await open(p, 'view');
    const {width, height} = (await p.rest()).view.camera;
    await p.page.click('#image-like');
    assert.deepEqual([await p.page.inputValue('#image-width'), await p.page.inputValue('#image-height')], [String(width), String(height)]);
    await p.page.fill('#image-width', '333');
    await p.page.fill('#image-height', '217');
    const file = await p.saved(() => p.page.click('#save-image'));
    assert.equal(file.suggestedFilename(), 'model-333x217.png');
    const bytes = fs.readFileSync(await file.path());
    assert.deepEqual([bytes.readUInt32BE(16), bytes.readUInt32BE(20)], [333, 217]);
    const {camera} = p.sent.find((m) => m.type === 'image');
    fs.writeFileSync(path.join(work, 'image.json'), JSON.stringify([{...camera, name: 'image'}]));
    await gart.run('render', 'run/model.ply', 'image.json', '--out', 'image', '--backend', 'openmp', '--quiet');
    const alike = await psnr(browser, bytes, fs.readFileSync(path.join(work, 'image', 'image.png')));
    assert.ok(alike > 70, `${alike} dB`);
    await p.page.fill('#image-width', '16000');
    await p.page.fill('#image-height', '16000');
    await p.page.click('#save-image');
    await p.until('a refusal', async () => (await p.page.textContent('#note')).includes('40 million'));
    await p.close();
  },

  async 'the crop and a known length make a command that writes the file'({browser, server, gart, work}, screen) {
    const p = await openPage(browser, server.look, screen), {model} = p.received[0];
    await open(p, 'tools');
    assert.equal(await p.page.isVisible('#export'), false);
    await p.page.check('#crop-on');
    const middle = (model.min[0] + model.max[0]) / 2;
    await p.page.fill('input[name=max-x]', String(middle));
    await p.page.keyboard.press('Enter');
    const command = await p.page.textContent('#command');
    assert.match(command, /^gart convert model.ply model-part.ply --crop=/);
    await gart.run(...command.replaceAll('model', 'run/model').split(' ').slice(1));
    const kept = meansOf(path.join(work, 'run', 'model-part.ply')), all = meansOf(path.join(work, 'run', 'model.ply'));
    fs.rmSync(path.join(work, 'run', 'model-part.ply'));
    const {crop} = (await p.rest()).view, min = crop.min.map(Math.fround), max = crop.max.map(Math.fround);
    const inside = all.filter((mean) => mean.every((x, k) => x >= min[k] && x <= max[k]));
    assert.ok(inside.length > 0 && inside.length < all.length);
    assert.equal(kept.length, inside.length);
    await p.close();
  },

  async 'a measure gives the scale of a known length, and is gone when it is off'({browser, gart, work}, screen) {
    const balls = [[-0.8, 0.3, 0.2, 0.02, [0.9, 0.2, 0.2]], [0.7, -0.4, 0.5, 0.02, [0.2, 0.6, 0.9]]];
    const others = [[0.1, 0.5, -0.6, 0.02, [0.4, 0.8, 0.3]], [0.7, 0.3, 0.6, 0.01, [0.4, 0.8, 0.3]]];
    fs.writeFileSync(path.join(work, 'pair.ply'), splatPly([...balls, ...others]));
    const server = await gart.serve('view', 'pair.ply', '--backend', 'serial');
    const p = await openPage(browser, server.control, screen);
    await open(p, 'tools');
    await p.page.mouse.move(150, 150);
    const inView = ({camera}) => balls.every((ball) => {
      const [x, y, z] = pixelOf(camera, ball.slice(0, 3));
      return z > 0 && x > 20 && y > 60 && x < camera.width - 20 && y < camera.height - 20;
    });
    await p.until('both in view', async () => inView(p.last()) || (await p.page.mouse.wheel(0, 120), await p.rest(), false));
    const {view: {camera}} = await p.rest(), box = await p.page.locator('#stage').boundingBox();
    const yellow = () => linesOf(p.page, [255, 209, 102]);
    const distance = () => p.page.textContent('#distance');
    const measure = async () => {
      for (const ball of balls) {
        const [x, y] = pixelOf(camera, ball.slice(0, 3)), scale = box.width / camera.width;
        const answers = p.received.filter((m) => m.type === 'picked').length;
        await p.page.mouse.click(box.x + scale * x, box.y + scale * y);
        await p.until('an answer', () => p.received.filter((m) => m.type === 'picked').length === answers + 1);
      }
      await p.until('a distance', async () => /^\d/.test(await distance()));
    };
    assert.equal(await p.page.isDisabled('#length'), true);
    await p.page.click('#measure');
    await measure();
    const truth = apart(balls[0].slice(0, 3), balls[1].slice(0, 3));
    assert.ok(Math.abs(Number(await distance()) / truth - 1) < 0.02, `${await distance()} instead of ${truth}`);
    await p.until('the line', async () => (await yellow()) > 20);
    await p.page.fill('#length', '25');
    await p.page.keyboard.press('Enter');
    assert.equal(await distance(), '25');
    await measure();
    assert.ok(Math.abs(Number(await distance()) / 25 - 1) < 0.01, 'the same points have the same length');
    const factor = Number((await p.page.textContent('#command')).match(/--transform 1,0,0,0,0,0,0,([\d.]+)$/)[1]);
    assert.ok(Math.abs(factor * truth / 25 - 1) < 0.02);
    await p.page.click('#measure');
    assert.equal(await distance(), '–');
    await p.until('nothing of it', async () => (await yellow()) === 0);
    await p.page.click('#forget-scale');
    assert.equal(await p.page.isVisible('#export'), false);
    await p.close();
    server.child.kill('SIGINT');
    assert.equal(await server.ended, 0, 'Ctrl-C ends it with 0');
  },

  async 'another model is opened, and what is none says so'({browser, gart, work}, screen) {
    await gart.run('convert', 'run/model.ply', 'run/fewer.ply', '--prune', '0.3', '--quiet');
    fs.writeFileSync(path.join(work, 'run', 'none.ply'), 'ply\nnonsense\n');
    const server = await gart.serve('view', 'run/model.ply', 'capture', '--backend', 'openmp');
    const p = await openPage(browser, server.control, screen), looker = await openPage(browser, server.look, screen);
    await open(p, 'view');
    await open(looker, 'view');
    assert.equal(await looker.page.isVisible('#models'), false);
    const {gaussians} = p.received[0].model;
    await p.page.selectOption('#models', {label: 'fewer.ply'});
    for (const one of [p, looker]) {
      await one.until('the other model', async () => (await one.page.title()) === 'fewer.ply – gart');
      const {view} = await one.rest();
      assert.ok(apart(placeOf(view.camera), placeOf(one.received[0].cameras[0].camera)) < 1e-6, 'it begins at home');
    }
    assert.ok(p.received.filter((m) => m.type === 'hello').at(-1).model.gaussians < gaussians);
    await p.page.selectOption('#models', {label: 'none.ply'});
    await p.until('a word', async () => (await p.page.textContent('#note')).startsWith('It could not be opened'));
    assert.equal(await p.page.title(), 'fewer.ply – gart');
    await p.close();
    await looker.close();
    server.child.kill('SIGTERM');
    assert.equal(await server.ended, 0);
    for (const name of ['fewer.ply', 'none.ply']) fs.rmSync(path.join(work, 'run', name));
  },
});
