// The capture's cameras: in the list, over the frame, and their photographs beside the render.

import assert from 'node:assert/strict';
import {openPage} from './browser.mjs';
import {apart, pixelOf, placeOf} from './geometry.mjs';

// The page sets axes at right angles again, which a file's digits are not quite.
const same = (a, b) => a.flat().every((x, i) => Math.abs(x - b.flat()[i]) < 1e-6);

export const cameras = {
  async 'a camera of the list is looked through, its photograph beside the render'({browser, server}) {
    const p = await openPage(browser, server.control), all = p.received[0].cameras;
    assert.equal(all.length, 10);
    assert.equal(all.filter((c) => c.test).length, 2);
    await p.tab('cameras');
    const wanted = all.find((c) => c.test);
    await p.page.fill('#find', 'test');
    await p.page.locator('#camera-list button:visible', {hasText: wanted.name}).first().click();
    const {view, jpeg} = await p.rest();
    assert.ok(same(view.camera.c2w, wanted.camera.c2w));
    assert.equal(view.photo, wanted.index);
    const shape = view.camera.width / view.camera.height;
    assert.ok(Math.abs(shape - wanted.camera.width / wanted.camera.height) < 0.01);
    assert.ok(Math.abs(view.camera.fx / view.camera.width - wanted.camera.fx / wanted.camera.width) < 1e-6);

    await p.page.check('#compare');
    await p.until('the photograph', () => p.page.evaluate(() => document.getElementById('photo').naturalWidth > 0));
    const [photo, frame] = await Promise.all(['#photo', '#frame'].map((id) => p.page.locator(id).boundingBox()));
    for (const side of ['x', 'y', 'width', 'height']) assert.ok(Math.abs(photo[side] - frame[side]) < 1, side);
    const file = await p.page.request.get(`${server.control}photo/${wanted.index}.jpg`);
    assert.equal(file.status(), 200);
    assert.ok(jpeg.length > 0 && (await file.body()).length > 0);

    const value = () => p.page.getAttribute('#divider', 'aria-valuenow').then(Number);
    await p.page.focus('#divider');
    await p.page.keyboard.press('PageUp');
    assert.equal(await value(), 70);
    const box = await p.page.locator('#divider').boundingBox();
    await p.page.mouse.move(box.x + box.width / 2, box.y + 80);
    await p.page.mouse.down();
    await p.page.mouse.move(photo.x + 0.25 * photo.width, box.y + 80);
    await p.page.mouse.up();
    assert.equal(await value(), 25);

    await p.page.click('#next');
    const next = await p.rest();
    assert.ok(same(next.view.camera.c2w, all[(all.indexOf(wanted) + 1) % all.length].camera.c2w));
    await p.close();
  },

  async 'a camera is looked through that is clicked on in the view'({browser, server}) {
    const p = await openPage(browser, server.control), {cameras: all, model} = p.received[0];
    await p.page.mouse.move(290, 280);
    const near = placeOf(p.last().camera);
    await p.page.mouse.wheel(0, 1200);
    await p.until('a farther view', () => apart(placeOf(p.last().camera), near) > 0.1);
    const {view} = await p.rest(), box = await p.page.locator('#stage').boundingBox();
    const tips = all.map((c) => ({c, at: pixelOf(view.camera, placeOf(c.camera))}));
    const clear = tips.filter(({at: [x, y, z]}) => z > 0.1 * model.extent && x > 20 && y > 80 && x < box.width - 20 && y < box.height - 20);
    const alone = clear.find((a) => tips.every((b) => a === b || Math.hypot(a.at[0] - b.at[0], a.at[1] - b.at[1]) > 30));
    assert.ok(alone, 'no camera stands alone in the view');
    await p.page.mouse.click(box.x + alone.at[0], box.y + alone.at[1]);
    const {view: through} = await p.rest();
    assert.ok(same(through.camera.c2w, alone.c.camera.c2w), `${alone.c.name} was clicked on`);
    await p.close();
  },
};
