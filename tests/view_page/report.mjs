// report.html of a run: what the model looks like first, and no more than the screen's width.

import assert from 'node:assert/strict';
import path from 'node:path';
import {pathToFileURL} from 'node:url';
import {onEach} from './screens.mjs';

export const report = onEach({
  async 'report.html fits, and begins with a picture of the model'({browser, work}, screen) {
    const context = await browser.newContext(screen), page = await context.newPage();
    await page.goto(pathToFileURL(path.resolve(work, 'run', 'report.html')).href);
    const seen = await page.evaluate(() => {
      const image = document.querySelector('img'), box = image.getBoundingClientRect();
      return {wide: document.documentElement.scrollWidth - innerWidth, drawn: image.naturalWidth, top: box.top, bottom: box.bottom,
        over: [...document.querySelectorAll('body *')].filter((e) => !e.closest('.wide, .box, details') && e.getBoundingClientRect().right > innerWidth + 0.5)
          .map((e) => e.outerHTML.slice(0, 80))};
    });
    assert.deepEqual([seen.wide, seen.over], [0, []]);
    assert.ok(seen.drawn > 0 && seen.top < 0.5 * screen.viewport.height, `the picture begins at ${seen.top}`);
    await context.close();
  },
});
