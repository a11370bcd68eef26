// Who may come in, and what people find who do not see the page or have a narrow one.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import {openPage} from './browser.mjs';

const source = new URL('../../backends/view/page/', import.meta.url);

export const people = {
  async 'the page is at most 150 KB, names no outside address and has no inline script or style'() {
    const files = fs.readdirSync(source).map((name) => ({name, text: fs.readFileSync(new URL(name, source), 'utf8')}));
    const size = files.reduce((sum, {text}) => sum + Buffer.byteLength(text), 0);
    assert.ok(size <= 150e3, `${size} bytes`);
    for (const {name, text} of files) {
      const addresses = (text.match(/\w+:\/\/[^\s'"`]+/g) ?? []).filter((a) => a !== 'http://www.w3.org/2000/svg');
      assert.deepEqual(addresses, [], name);
      if (name.endsWith('.html')) assert.ok(!/<style|\sstyle=|\son\w+=|<script(?![^>]*\ssrc=)/.test(text), `${name} has something inline`);
      assert.ok(!/innerHTML|eval\(|new Function/.test(text), `${name} makes code or markup of text`);
    }
  },

  async 'a wrong token is refused'({browser, server}) {
    const wrong = server.control.replace(/[0-9a-f]{32}/, '0'.repeat(32));
    const page = await browser.newPage();
    for (const address of [wrong, `${wrong}main.js`, new URL('/', wrong).href, `${wrong}photo/0.jpg`])
      assert.equal((await page.request.get(address)).status(), 403, address);
    await page.goto(server.control);
    const opened = await page.evaluate((address) => new Promise((resolve) => {
      const socket = new WebSocket(address, 'gart-view');
      socket.onopen = () => resolve(true);
      socket.onerror = () => resolve(false);
    }), `${wrong.replace('http', 'ws')}socket`);
    assert.equal(opened, false);
    await page.close();
  },

  async 'every control has a name, and no two have the same id'({browser, server}) {
    const p = await openPage(browser, server.control);
    const nameless = await p.page.locator('button, input, select, [role=tab], [role=slider], [role=img], img').evaluateAll((all) =>
      all.filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.length || e.hasAttribute('alt')))
        .map((e) => e.outerHTML));
    assert.deepEqual(nameless, []);
    const ids = await p.page.locator('[id]').evaluateAll((all) => all.map((e) => e.id));
    assert.equal(new Set(ids).size, ids.length);
    const dangling = await p.page.locator('[aria-controls], [aria-labelledby], [aria-describedby]').evaluateAll((all) =>
      all.flatMap((e) => ['aria-controls', 'aria-labelledby', 'aria-describedby'].map((a) => e.getAttribute(a)))
        .filter((id) => id && !document.getElementById(id)));
    assert.deepEqual(dangling, []);

    // Tabs by arrow keys; what a mode change says is in the live region.
    await p.page.focus('#tab-view');
    await p.page.keyboard.press('ArrowRight');
    assert.equal(await p.page.isVisible('#panel-cameras'), true);
    await p.page.keyboard.press('ArrowLeft');
    await p.page.focus('#modes input[value=colour]');
    await p.page.keyboard.press('ArrowRight');
    await p.until('the mode to be said', async () => (await p.page.textContent('#say')) === 'Depth');
    await p.page.focus('#stage');
    await p.page.keyboard.press('h');
    assert.equal(await p.page.isVisible('#help'), true);
    await p.page.keyboard.press('Escape');
    assert.equal(await p.page.isVisible('#help'), false);
    await p.close();
  },

  async 'a narrow page has its controls in a sheet, and nothing is wider than the screen'({browser, server}) {
    const p = await openPage(browser, server.look, {viewport: {width: 360, height: 700}, hasTouch: true, isMobile: true});
    assert.equal(p.received[0].right, 'view');
    const high = async () => (await p.page.locator('#stage').boundingBox()).height;
    const alone = await high();
    assert.ok(alone > 600, `the view has ${alone} of 700 pixels`);
    for (const tab of ['view', 'cameras', 'tools', 'path']) {
      await p.page.tap(`#tab-${tab}`);
      assert.equal(await p.page.isVisible(`#panel-${tab}`), true);
      assert.ok((await high()) > 300);
      const wide = await p.page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= 360, `${tab} is ${wide} pixels wide`);
      const small = await p.page.locator(`#panel-${tab} button:visible`).evaluateAll((all) =>
        all.filter((b) => b.getBoundingClientRect().height < 40).map((b) => b.textContent));
      assert.deepEqual(small, [], 'too small for a finger');
    }
    await p.page.tap('#tab-path');
    assert.equal(await high(), alone, 'a second tap closes the sheet');
    await p.close();
  },
};
