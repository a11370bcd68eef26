// Who may come in, and what people find who do not see the page or have a narrow one.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import {openPage} from './browser.mjs';

const source = new URL('../../src/view/page/', import.meta.url);

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

  async 'a host that is allowed serves the page, another name does not'({browser, gart}) {
    const server = await gart.serve('view', 'run/model.ply', '--backend', 'openmp', '--allow-host', 'viewer.test');
    const p = await openPage(browser, server.control.replace('127.0.0.1', 'viewer.test'));
    assert.equal(p.received[0].right, 'control');
    await p.close();
    const page = await browser.newPage();
    assert.equal((await page.goto(server.control.replace('127.0.0.1', 'other.test'))).status(), 403);
    await page.close();
    server.child.kill('SIGINT');
    assert.equal(await server.ended, 0);
    assert.match(server.text(), /for the host 'other.test:\d+' from the origin '' \(--allow-host NAME lets a host in\)/);
  },

  async 'a page whose place another one took says so, and comes back when it is asked to'({browser, server}) {
    const page = await browser.newPage();
    let tries = 0;
    await page.routeWebSocket(/\/socket$/, (socket) => {
      ++tries;
      socket.close({code: 1013, reason: 'another page took the place of this one'});
    });
    await page.goto(server.control);
    await page.waitForSelector('#lost:visible');
    assert.equal(await page.textContent('#lost span'), 'another page took the place of this one');
    await page.waitForTimeout(1500);
    assert.equal(tries, 1, 'it came back by itself');
    await page.click('#again');
    for (let i = 0; i < 200 && tries < 2; ++i) await page.waitForTimeout(50);
    assert.equal(tries, 2, 'it did not try again');
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
