// Orbit, fly and walk by hand and by keys; adaptive resolution.

import assert from 'node:assert/strict';
import {openPage} from './browser.mjs';
import {along, apart, dot, forwardOf, isRotation, minus, placeOf} from './geometry.mjs';

const middle = [290, 280];

export const navigation = {
  async 'a drag orbits: the point ahead stays where it is, at its distance'({browser, server}) {
    const p = await openPage(browser, server.control);
    const {model} = p.received[0], before = p.last().camera;
    assert.equal(await p.page.title(), `${model.name} – gart`);
    const far = dot(minus(model.center, placeOf(before)), forwardOf(before));
    await p.drag(middle, [120, 40]);
    const {view: {camera: after}} = await p.rest();
    assert.ok(apart(placeOf(before), placeOf(after)) > 0.1 * far, 'the camera did not move');
    assert.ok(isRotation(after));
    const pivot = along(placeOf(before), forwardOf(before), far);
    assert.ok(apart(pivot, along(placeOf(after), forwardOf(after), far)) < 1e-6 * far);
    // Dragged to the right the camera goes to the left, and dragged down up.
    assert.ok(dot(minus(placeOf(after), placeOf(before)), before.c2w.slice(0, 3).map((row) => row[0])) < 0);
    assert.ok(dot(minus(placeOf(after), placeOf(before)), model.up) > 0);

    await p.page.mouse.wheel(0, -300);
    await p.until('a nearer view', () => apart(pivot, placeOf(p.last().camera)) < 0.95 * far);
    const {view: {camera: near}} = await p.rest();
    const ratio = apart(pivot, placeOf(near)) / far;
    assert.ok(ratio > 0.3 && ratio < 0.9, `the wheel brought it to ${ratio} of the distance`);
    await p.close();
  },

  async 'keys alone: turn, fly, walk at one height, home'({browser, server}) {
    const p = await openPage(browser, server.control), {up} = p.received[0].model;
    for (let i = 0; i < 3 && !(await p.page.evaluate(() => document.activeElement.id === 'stage')); ++i)
      await p.page.keyboard.press('Tab');
    assert.equal(await p.page.evaluate(() => document.activeElement.id), 'stage', 'Tab does not lead to the view');
    const hold = async (key) => {
      const before = p.last().camera;
      await p.page.keyboard.down(key);
      await p.until(`${key} to move the camera`, () => apart(placeOf(p.last().camera), placeOf(before)) > 0.02);
      await p.page.keyboard.up(key);
      const {view: {camera: after}} = await p.rest();
      return {before, after, way: minus(placeOf(after), placeOf(before))};
    };
    const home = p.last().camera;
    const turned = await hold('ArrowLeft');
    assert.ok(apart(placeOf(turned.before), placeOf(turned.after)) > 0.01);

    const flown = await hold('w');
    assert.equal(await p.page.isChecked('#styles input[value=fly]'), true);
    const ahead = dot(flown.way, forwardOf(flown.before));
    assert.ok(ahead > 0 && Math.abs(ahead - apart(placeOf(flown.before), placeOf(flown.after))) < 1e-9);

    await p.page.keyboard.press('g');
    await p.rest();
    const walked = await hold('w');
    assert.ok(Math.hypot(...walked.way) > 0.01);
    assert.ok(Math.abs(dot(walked.way, up)) < 1e-9, 'walking changed the height');
    const side = walked.after.c2w.slice(0, 3).map((row) => row[0]);
    assert.ok(Math.abs(dot(side, up)) < 1e-9, 'the horizon is not level');
    const lifted = await hold('e');
    assert.ok(dot(lifted.way, up) > 0);

    await p.page.keyboard.press('r');
    const {view} = await p.rest();
    assert.deepEqual(view.camera, home);
    await p.close();
  },

  async 'frames are smaller while the camera moves where they have to be, and whole at rest'({browser, server}) {
    const p = await openPage(browser, server.control, {viewport: {width: 1100, height: 700}, deviceScaleFactor: 2});
    const whole = (await p.rest()).header;
    assert.deepEqual([whole.width, whole.height], whole.full);
    const first = p.frames.length;
    const box = await p.page.locator('#stage').boundingBox();
    await p.page.mouse.move(box.x + 300, box.y + 300);
    await p.page.mouse.down();
    const movingNow = () => p.frames.slice(first).map((f) => f.header).filter((h) => !h.still);
    for (let i = 0; i < 400 && (i < 40 || movingNow().length < 3); ++i) {
      await p.page.mouse.move(box.x + 300 + 4 * (i % 30), box.y + 300 + 2 * (i % 20));
      await p.page.waitForTimeout(25);
    }
    await p.page.mouse.up();
    const up = Date.now();
    const {header} = await p.rest();
    assert.deepEqual([header.width, header.height], header.full, 'at rest it is whole');
    const moving = movingNow();
    assert.ok(moving.length >= 3, `${moving.length} frames while it moved`);
    assert.ok(moving.every((h) => h.width <= h.full[0]));
    if (whole.ms > 150) assert.ok(moving.at(-1).width < 0.9 * whole.width, `${moving.at(-1).width} of ${whole.width}`);
    console.log(`           at rest ${whole.width} x ${whole.height} in ${whole.ms.toFixed(0)} ms, moving ` +
      `${moving.at(-1).width} x ${moving.at(-1).height} in ${moving.at(-1).ms.toFixed(0)} ms, whole after ${Date.now() - up} ms`);
    assert.ok(p.views().some((v) => v.moving) && !p.last().moving);
    await p.close();
  },

  async 'fingers: one turns, two pinch'({browser, server}) {
    const p = await openPage(browser, server.control, {viewport: {width: 390, height: 760}, hasTouch: true, isMobile: true});
    const center = p.received[0].model.center, cdp = await p.context.newCDPSession(p.page);
    const touch = (type, points) => cdp.send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([x, y], id) => ({x, y, id}))});
    const gesture = async (at, steps = 8) => {
      await touch('touchStart', at(0));
      for (let i = 1; i <= steps; ++i) await touch('touchMove', at(i / steps));
      await touch('touchEnd', []);
      return (await p.rest()).view.camera;
    };
    const before = p.last().camera;
    const turned = await gesture((t) => [[200 - 90 * t, 300]]);
    assert.ok(apart(placeOf(before), placeOf(turned)) > 0.1);
    const nearer = await gesture((t) => [[195, 300 - 30 - 60 * t], [195, 300 + 30 + 60 * t]]);
    const ratio = apart(placeOf(nearer), center) / apart(placeOf(turned), center);
    assert.ok(ratio < 0.8, `a pinch brought it to ${ratio} of the distance`);
    await p.close();
  },
};
