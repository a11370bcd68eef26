// The crop box and the distance between two points.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {openPage} from './browser.mjs';
import {pixelOf} from './geometry.mjs';
import {splatPly} from './geometry.mjs';

export const tools = {
  async 'a crop box leaves out what is outside, by numbers and by its handles'({browser, server}) {
    const p = await openPage(browser, server.control), {model} = p.received[0];
    await p.choose('alpha');
    const whole = await p.rest();
    await p.tab('tools');
    await p.page.check('#crop-on');
    const boxed = await p.rest();
    for (const side of ['min', 'max'])
      boxed.view.crop[side].forEach((x, k) => assert.ok(Math.abs(x - model[side][k]) < 1e-6));
    const half = (model.min[0] + model.max[0]) / 2;
    await p.page.fill('input[name=max-x]', String(half));
    await p.page.keyboard.press('Enter');
    await p.until('the number to be told', () => Math.abs(p.last().crop?.max[0] - half) < 1e-3);
    const cut = await p.rest();
    assert.ok(!cut.jpeg.equals(boxed.jpeg), 'the image did not change');

    // The handle in the middle of the face x = max.
    const {min, max} = cut.view.crop, face = [max[0], (min[1] + max[1]) / 2, (min[2] + max[2]) / 2];
    const [x, y] = pixelOf(cut.view.camera, face);
    const [u, v] = pixelOf(cut.view.camera, [face[0] - 0.2 * (max[0] - min[0]), face[1], face[2]]);
    await p.drag([x, y], [u - x, v - y]);
    const dragged = await p.rest();
    assert.ok(dragged.view.crop.max[0] < max[0] - 0.05 * (max[0] - min[0]), 'the handle did not move its face');
    assert.deepEqual(dragged.view.crop.min, min);
    assert.deepEqual(dragged.view.camera, cut.view.camera, 'the camera moved with the handle');

    await p.page.uncheck('#crop-on');
    const back = await p.rest();
    assert.equal(back.view.crop, null);
    assert.ok(back.jpeg.equals(whole.jpeg), 'without a box it is the image of before');
    await p.close();
  },

  async 'a measured distance is within 1%'({browser, gart, work}) {
    // Small opaque balls: a ray through the middle of one is at its depth where it meets it.
    const balls = [[-0.8, 0.3, 0.2, 0.03, [0.9, 0.2, 0.2]], [0.7, -0.4, 0.5, 0.03, [0.2, 0.6, 0.9]], [0.1, 0.5, -0.6, 0.05, [0.4, 0.8, 0.3]]];
    fs.writeFileSync(path.join(work, 'balls.ply'), splatPly(balls));
    const server = await gart.serve('view', 'balls.ply', '--backend', 'serial');
    const p = await openPage(browser, server.control, {viewport: {width: 900, height: 600}});
    const {view: {camera}} = await p.rest();
    await p.tab('tools');
    await p.page.click('#measure');
    const box = await p.page.locator('#stage').boundingBox();
    for (const ball of balls.slice(0, 2)) {
      const [x, y] = pixelOf(camera, ball.slice(0, 3));
      await p.page.mouse.click(box.x + x, box.y + y);
      await p.until('an answer', () => p.received.filter((m) => m.type === 'picked').length === balls.indexOf(ball) + 1);
    }
    await p.until('a distance', async () => /^\d/.test(await p.page.textContent('#distance')));
    const truth = Math.hypot(...[0, 1, 2].map((k) => balls[0][k] - balls[1][k]));
    const measured = Number(await p.page.textContent('#distance'));
    console.log(`           ${measured} of ${truth.toFixed(4)}`);
    assert.ok(Math.abs(measured / truth - 1) < 0.01, `${measured} instead of ${truth}`);

    // Where there is nothing, nothing is measured.
    await p.page.click('#measure');
    await p.page.mouse.click(box.x + 20, box.y + box.height - 20);
    await p.until('the page to say so', async () => (await p.page.textContent('#say')).includes('nothing'));
    await p.close();
    server.child.kill('SIGTERM');
    await server.ended;
  },
};
