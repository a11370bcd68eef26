// How the model is drawn, and that every mode and control is in reach.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {meanOf, openPage} from './browser.mjs';
import {splatPly} from './geometry.mjs';
import {onEach} from './screens.mjs';

// A slider has powers of two.
const slide = (p, id, power) => p.page.$eval(`#${id}`, (input, value) => {
  input.value = value;
  input.dispatchEvent(new Event('input', {bubbles: true}));
}, String(power));

export const look = onEach({
  async 'opacity, size, background, ellipsoids and points'({browser, server}, screen) {
    const p = await openPage(browser, server.look, screen);
    if (!(await p.page.isVisible('#panel-view'))) await p.tab('view');
    const first = await p.rest();
    const mean = async () => meanOf(p.page, (await p.rest()).jpeg);
    await p.choose('alpha');
    const whole = await mean();
    await slide(p, 'opacity', -5);
    await p.until('the factor', () => p.last().opacity === 1 / 32);
    assert.ok((await mean()) < 0.5 * whole, 'fainter');
    assert.equal(await p.page.textContent('#opacity-now'), '× 0.031');
    await slide(p, 'opacity', 0);
    await slide(p, 'splat-size', -2);
    await p.until('the factor', () => p.last().size === 0.25);
    const small = await mean();
    assert.ok(small < 0.9 * whole, 'smaller');
    await slide(p, 'splat-size', 0);
    await p.page.check('#shapes input[value=ellipsoids]');
    await p.until('ellipsoids', () => p.last().shape === 'ellipsoids');
    const solid = await mean();
    assert.ok(Math.abs(solid - whole) > 0.002 * whole, `ellipsoids: ${solid} of ${whole}`);
    await p.page.check('#shapes input[value=points]');
    await p.until('points', () => p.last().shape === 'points');
    const points = await mean();
    assert.ok(points > 0 && points < 0.5 * whole, `points: ${points} of ${whole}`);
    await p.page.check('#shapes input[value=gaussians]');
    await p.choose('colour');
    const before = await mean();
    await p.page.fill('#background', '#00ff00');
    await p.until('the background', () => p.last().background?.[1] === 1);
    assert.ok(Math.abs((await mean()) - before) > 1e-3, 'another background');
    await p.page.click('#look-reset');
    const {jpeg, view} = await p.rest();
    assert.equal(view.background, null);
    assert.ok(jpeg.equals(first.jpeg), 'as trained it is the image of before');
    assert.equal(await p.page.isDisabled('#look-reset'), true);
    await p.close();
  },

  async 'every mode is in reach, hits and error too'({browser, server}, screen) {
    const p = await openPage(browser, server.look, screen);
    if (!(await p.page.isVisible('#panel-view'))) await p.tab('view');
    for (const mode of ['hits', 'error', 'depth', 'normal', 'alpha', 'colour']) {
      const label = p.page.locator('#modes label', {has: p.page.locator(`input[value=${mode}]`)});
      await label.scrollIntoViewIfNeeded();
      const {x, y, width, height} = await label.boundingBox(), {viewport} = screen;
      assert.ok(x >= 0 && y >= 0 && x + width <= viewport.width && y + height <= viewport.height, `${mode} is at ${x}, ${y}`);
      await p.page.mouse.click(x + width / 2, y + height / 2);
      assert.equal((await p.rest()).header.mode, mode);
    }
    await p.close();
  },

  async 'features are shown as one scale, as three colours and as directions'({browser, server, gart, work}, screen) {
    const ball = (x, i) => [x, 0, 0, 0.3, [0.5, 0.5, 0.5], [i, 10 - i, i % 2, 5]];
    fs.writeFileSync(path.join(work, 'features.ply'), splatPly([-1.5, -0.5, 0.5, 1.5].map(ball)));
    const own = await gart.serve('view', 'features.ply', '--backend', 'serial');
    const p = await openPage(browser, own.look, screen);
    assert.equal(p.received[0].model.features, 4);
    if (!(await p.page.isVisible('#panel-view'))) await p.tab('view');
    assert.equal(await p.page.isVisible('#feature-choice'), false);
    const colour = await p.rest();
    await p.choose('features');
    const directions = await p.rest();
    assert.equal(directions.view.features, null);
    assert.ok(!directions.jpeg.equals(colour.jpeg));
    const what = () => p.page.textContent('#legend .what');
    assert.match(await what(), /first three principal directions of 4 features/);
    assert.equal(await p.page.isVisible('#legend .bar'), false);

    await p.page.selectOption('#feature-kind', 'one');
    const first = await p.rest();
    assert.deepEqual(first.view.features, [0]);
    assert.match(await what(), /feature 0, mean along the ray/);
    assert.deepEqual(await p.page.$$eval('#legend .ends span', (all) => all.map((e) => e.textContent)), ['0', '2']);
    await p.page.locator('#feature-places input').first().fill('1');
    await p.page.keyboard.press('Enter');
    const second = await p.rest();
    assert.deepEqual(second.view.features, [1]);
    assert.ok(!second.jpeg.equals(first.jpeg));
    // A number that no feature has is put right.
    await p.page.locator('#feature-places input').first().fill('4');
    await p.page.keyboard.press('Enter');
    assert.equal(await p.page.locator('#feature-places input').first().inputValue(), '1');

    await p.page.selectOption('#feature-kind', 'three');
    const three = await p.rest();
    assert.deepEqual(three.view.features, [1, 1, 2]);
    assert.match(await what(), /Red, green and blue: features 1, 1, 2/);
    assert.equal(await p.page.locator('#feature-places input:visible').count(), 3);
    const places = await p.page.locator('#feature-places').boundingBox();
    assert.ok(places.x + places.width <= screen.viewport.width);
    await p.page.screenshot({path: path.join(work, `features-${screen.viewport.width}.png`)});

    // A reload keeps them; colours are as before.
    await p.page.reload();
    await p.message('hello');
    assert.deepEqual((await p.rest()).view.features, [1, 1, 2]);
    if (!(await p.page.isVisible('#panel-view'))) await p.tab('view');
    await p.choose('colour');
    await p.close();
    const other = await openPage(browser, server.look, screen);
    if (!(await other.page.isVisible('#panel-view'))) await other.tab('view');
    assert.equal(await other.page.locator('#modes label:has(input[value=hits])').isVisible(), true);
    assert.equal(await other.page.locator('#modes label:has(input[value=features])').isVisible(), false);
    await other.close();
    own.child.kill('SIGTERM');
    await own.ended;
  },

  async 'nothing is wider than its place, and all of it can be scrolled to'({browser, server}, screen) {
    const p = await openPage(browser, server.control, screen);
    for (const tab of ['cameras', 'tools', 'path', 'view']) {
      await p.tab(tab);
      if (tab === 'tools') await p.page.check('#crop-on');
      if (tab === 'path') await p.page.click('#add-key'), await p.page.click('#add-key'), await p.page.check('#timed');
      const wide = await p.page.evaluate((id) => {
        const panel = document.getElementById(id), {right} = panel.getBoundingClientRect();
        const over = [...panel.querySelectorAll('*')].filter((e) => !e.closest('.unseen') && e.getBoundingClientRect().right > right + 0.5);
        return {page: document.documentElement.scrollWidth - innerWidth, panel: panel.scrollWidth - panel.clientWidth,
          over: over.map((e) => e.outerHTML.slice(0, 80))};
      }, `panel-${tab}`);
      assert.deepEqual(wide, {page: 0, panel: 0, over: []}, tab);
      const last = p.page.locator(`#panel-${tab} button:visible, #panel-${tab} input:visible`).last();
      await last.scrollIntoViewIfNeeded();
      const {y, height} = await last.boundingBox();
      assert.ok(y >= 0 && y + height <= screen.viewport.height, `the end of ${tab} is at ${y}`);
    }
    const stage = await p.page.locator('#stage').boundingBox();
    assert.ok(stage.width * stage.height > 0.3 * screen.viewport.width * screen.viewport.height, 'the view is small');
    await p.close();
  },
});
