// The crop box and the distance between two points.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {openPage} from './browser.mjs';
import {pixelOf, splatPly} from './geometry.mjs';

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
    // The side across which the view looks: its handle has a way to go on the screen.
    const {min, max} = boxed.view.crop, middle = min.map((x, k) => (x + max[k]) / 2);
    const faceOf = (k, value) => middle.map((x, i) => (i === k ? value : x));
    const wayOf = (k) => [max[k], min[k]].map((value) => pixelOf(boxed.view.camera, faceOf(k, value)));
    const seen = (k) => Math.hypot(wayOf(k)[0][0] - wayOf(k)[1][0], wayOf(k)[0][1] - wayOf(k)[1][1]);
    const k = [0, 1, 2].reduce((best, i) => (seen(i) > seen(best) ? i : best));
    await p.page.fill(`input[name=max-${'xyz'[k]}]`, String(middle[k]));
    await p.page.keyboard.press('Enter');
    await p.until('the number to be told', () => Math.abs(p.last().crop?.max[k] - middle[k]) < 1e-3);
    const cut = await p.rest();
    assert.ok(!cut.jpeg.equals(boxed.jpeg), 'the image did not change');

    // The handle in the middle of that face.
    const [x, y] = pixelOf(cut.view.camera, faceOf(k, middle[k]));
    const [u, v] = pixelOf(cut.view.camera, faceOf(k, middle[k] - 0.2 * (max[k] - min[k])));
    await p.drag([x, y], [u - x, v - y]);
    const dragged = await p.rest();
    assert.ok(dragged.view.crop.max[k] < middle[k] - 0.1 * (max[k] - min[k]), 'the handle did not move its face');
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
    const inView = ({camera}) => balls.every((ball) => {
      const [x, y, z] = pixelOf(camera, ball.slice(0, 3));
      return z > 0 && x > 20 && y > 60 && x < camera.width - 20 && y < camera.height - 20;
    });
    await p.page.mouse.move(290, 280);
    await p.until('all balls in view', async () => inView(p.last()) || (await p.page.mouse.wheel(0, 200), false));
    const {view: {camera}} = await p.rest();
    assert.ok(inView({camera}));
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
    await p.page.mouse.click(box.x + 20, box.y + box.height - 20);
    await p.until('the page to say so', async () => (await p.page.textContent('#say')).includes('nothing'));
    await p.close();
    server.child.kill('SIGTERM');
    await server.ended;
  },
};
