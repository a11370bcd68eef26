// A page of the viewer, with all that goes over its socket.

import assert from 'node:assert/strict';

// Seconds until what is waited for is taken to never come: a fault, however much else the machine has to do.
const longest = Number(process.env.GART_LONGEST ?? 90);

export async function openPage(browser, address, options = {}) {
  const context = await browser.newContext({viewport: {width: 900, height: 600}, acceptDownloads: true, ...options});
  context.setDefaultTimeout(1000 * longest);
  const page = await context.newPage();
  const sent = [], received = [], frames = [], faults = [];
  page.on('pageerror', (error) => faults.push(error.stack));
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  page.on('websocket', (socket) => {
    socket.on('framesent', ({payload}) => sent.push(JSON.parse(payload)));
    socket.on('framereceived', ({payload}) => {
      if (typeof payload === 'string') return received.push(JSON.parse(payload));
      const length = payload.readUInt32LE(0);
      frames.push({header: JSON.parse(payload.subarray(4, 4 + length).toString()), jpeg: payload.subarray(4 + length)});
    });
  });
  await page.goto(address);

  const views = () => sent.filter((m) => m.type === 'view');
  const until = async (what, done) => {
    for (const end = Date.now() + 1000 * longest; Date.now() < end; await page.waitForTimeout(20)) {
      const value = await done();
      if (value) return value;
    }
    const said = await page.textContent('#state', {timeout: 5000}).catch(() => 'nothing');
    assert.fail(`${longest} s went by without ${what}; the page says "${said}"`);
  };
  const self = {
    page, context, sent, received, frames, faults, until, views,
    message: (type) => until(`a message ${type}`, () => received.find((m) => m.type === type)),
    last: () => views().at(-1),
    // The frame at rest of the newest view, once nothing moves any more.
    rest: async () => {
      // What was just done has reached the page when it draws anew.
      await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      return self.atRest();
    },
    atRest: () => until('a frame at rest', async () => {
      const view = views().at(-1), frame = frames.at(-1);
      if (!view || !frame || view.moving || !frame.header.still || frame.header.id !== view.id) return null;
      const [shown, busy] = await page.$eval('#stage', (stage) => [stage.dataset.frame, stage.ariaBusy]);
      return shown === String(view.id) && busy === 'false' ? {view, ...frame} : null;
    }),
    choose: (mode) => page.check(`#modes input[value=${mode}]`),
    tab: (name) => page.click(`#tab-${name}`),
    drag: async (from, by, steps = 8) => {
      const box = await page.locator('#stage').boundingBox();
      await page.mouse.move(box.x + from[0], box.y + from[1]);
      await page.mouse.down();
      await page.mouse.move(box.x + from[0] + by[0], box.y + from[1] + by[1], {steps});
      await page.mouse.up();
    },
    saved: async (click) => {
      const [download] = await Promise.all([page.waitForEvent('download'), click()]);
      return download;
    },
    close: async () => {
      await context.close();
      assert.deepEqual(faults, [], 'the browser reported faults');
    },
  };
  // What trains is asked for again and again, and at rest for a moment only.
  const {training} = await self.message('hello');
  if (training) await until('a frame', () => frames.some(({header}) => header.still));
  else await self.atRest();
  return self;
}

// The mean of an image's colours, 0 to 1, decoded by the browser.
export async function meanOf(page, bytes) {
  return page.evaluate(async (source) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(source), (c) => c.charCodeAt(0))], {type: 'image/jpeg'}));
    const canvas = new OffscreenCanvas(image.width, image.height), draw = canvas.getContext('2d');
    draw.drawImage(image, 0, 0);
    const {data} = draw.getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0;
    for (let i = 0; i < data.length; ++i) if (i % 4 !== 3) sum += data[i];
    return sum / (0.75 * data.length) / 255;
  }, bytes.toString('base64'));
}

// How many pixels of the lines over the frame have about this colour.
export const linesOf = (page, color) => page.evaluate((wanted) => {
  const canvas = document.getElementById('lines'), {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let n = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200 && wanted.every((c, k) => Math.abs(data[i + k] - c) < 30)) ++n;
  return n;
}, color);

// PSNR of two images, in dB, decoded by the browser.
export async function psnr(browser, a, b) {
  const page = await browser.newPage();
  const urls = [a, b].map((bytes) =>
    `data:image/${bytes[0] === 0x89 ? 'png' : 'jpeg'};base64,${Buffer.from(bytes).toString('base64')}`);
  const value = await page.evaluate(async (sources) => {
    const pixels = await Promise.all(sources.map(async (source) => {
      const image = new Image();
      image.src = source;
      await image.decode();
      const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight), draw = canvas.getContext('2d');
      draw.drawImage(image, 0, 0);
      return draw.getImageData(0, 0, canvas.width, canvas.height);
    }));
    if (pixels[0].width !== pixels[1].width || pixels[0].height !== pixels[1].height)
      throw new Error(`sizes differ: ${pixels.map((p) => `${p.width} x ${p.height}`).join(', ')}`);
    let sum = 0;
    const [p, q] = pixels.map((image) => image.data);
    for (let i = 0; i < p.length; ++i) if (i % 4 !== 3) sum += (p[i] - q[i]) ** 2;
    return -10 * Math.log10(sum / (p.length * 0.75) / 65025);
  }, urls);
  await page.close();
  return value;
}
