// A training behind the view: seen, paused, stepped, resumed, saved, stopped; and by those who may only look, not.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import {openPage} from './browser.mjs';
import {screens} from './screens.mjs';

export const training = {
  async 'a training is paused, stepped, resumed and stopped from the page'({browser, gart, work}) {
    const server = await gart.serve('train', 'capture', '--out', 'live', '--iterations', '100000', '--max-gaussians', '800',
      '--backend', 'openmp', '--eval-every', '10', '--view');
    const p = await openPage(browser, server.control);
    assert.equal(p.received[0].training, true);
    const status = () => p.received.filter((m) => m.type === 'status').at(-1);
    await p.until('steps', () => status()?.step > 0);
    await p.until('the curves', () => p.received.some((m) => m.type === 'curve' && m.test.length > 0));
    await p.until('the figures', async () => /dB/.test(await p.page.textContent('#test-now')));

    await p.page.click('#pause');
    await p.until('the pause', () => status().paused);
    await p.until('the button to resume', async () => (await p.page.textContent('#pause')) === 'Resume');
    const at = status().step, told = p.received.length;
    await p.until('more to be told', () => p.received.slice(told).filter((m) => m.type === 'status').length > 2);
    assert.equal(status().step, at, 'it went on');
    await p.page.click('#step');
    await p.until('one step', () => status().step === at + 1);

    const looker = await openPage(browser, server.look);
    assert.equal(looker.received[0].right, 'view');
    await looker.tab('training');
    for (const id of ['pause', 'save', 'stop', 'share']) assert.equal(await looker.page.isDisabled(`#${id}`), true, id);
    // Not by the page's kindness alone.
    await looker.page.evaluate(() => new Promise((resolve) => {
      const socket = new WebSocket(new URL('socket', location.href.replace('http', 'ws')), 'gart-view');
      socket.onopen = () => socket.send('{"type":"train","action":"resume"}');
      socket.onmessage = ({data}) => typeof data === 'string' && JSON.parse(data).type === 'refused' && resolve();
    }));
    await looker.until('a refusal', () => looker.received.some((m) => m.type === 'refused'));
    assert.equal(status().step, at + 1, 'one who may look made it go on');
    await looker.close();

    await p.page.click('#pause');
    await p.until('it to go on', () => !status().paused && status().step > at + 3);
    const saved = () => fs.statSync(path.join(work, 'live', 'checkpoint.gart')).mtimeMs, before = saved();
    await p.page.click('#save');
    await p.until('a checkpoint', () => saved() > before);
    await p.page.click('#stop');
    await p.page.click('#sure button[value=stop]');
    const code = await server.ended;
    assert.ok(code === 0 || code === 130, `it ended with ${code}`);
    await p.until('the page to say so', () => p.page.isVisible('#lost'));
    p.faults.length = 0;  // the socket is gone
    await p.close();
  },

  async 'save and stop are answered on the page, on every screen'({browser, gart}) {
    const server = await gart.serve('train', 'capture', '--out', 'answered', '--iterations', '100000', '--max-gaussians', '800',
      '--backend', 'openmp', '--eval-every', '10', '--view');
    const pages = [];
    for (const screen of Object.values(screens)) pages.push(await openPage(browser, server.control, screen));
    for (const p of pages) {
      if (!(await p.page.isVisible('#panel-training'))) await p.tab('training');
      await p.page.click('#save');
      await p.until('the answer', async () => /^Saved answered\/checkpoint.gart at step [\d,]+\.$/.test(await p.page.textContent('#note')));
      assert.equal(await p.page.isVisible('#note'), true);
      await p.until('scores of the test views', async () => p.received.some((m) => m.type === 'scores' && m.psnr.length === 2));
    }
    await pages[1].page.click('#stop');
    await pages[1].page.click('#sure button[value=stop]');
    await server.ended;
    for (const p of pages) {
      await p.until('the last word', async () => /The training was stopped, and saved: gart train --resume/.test(await p.page.textContent('#lost')));
      assert.equal(await p.page.isVisible('#lost'), true);
      p.faults.length = 0;
      await p.close();
    }
  },
};
