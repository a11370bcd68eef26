// The cases, one after the other, on a capture of 64 x 64 and a model trained on it for a second. run.sh calls this.

import fs from 'node:fs';
import path from 'node:path';
import {createRequire} from 'node:module';
import {gartAt, endAll} from './gart.mjs';
import {navigation} from './navigation.mjs';
import {images} from './images.mjs';
import {cameras} from './cameras.mjs';
import {tools} from './tools.mjs';
import {paths} from './paths.mjs';
import {people} from './people.mjs';
import {training} from './training.mjs';
import {look} from './look.mjs';
import {kept} from './kept.mjs';
import {files} from './files.mjs';
import {report} from './report.mjs';
import {scene} from './scene.mjs';

const [, , program, folder, executablePath, ...wanted] = process.argv;
const {chromium} = createRequire(path.join(path.resolve(folder), 'here.js'))('playwright-core');
const work = path.join(folder, 'work');
fs.rmSync(work, {recursive: true, force: true});
fs.mkdirSync(work, {recursive: true});
const started = Date.now(), seconds = () => ((Date.now() - started) / 1000).toFixed(1);

const gart = gartAt(path.resolve(program), path.resolve(work));
await gart.run('synth', '--out', 'capture', '--train', '8', '--test', '2', '--size', '64', '--samples', '4', '--points', '800',
  '--quiet');
await gart.run('train', 'capture', '--out', 'run', '--iterations', '60', '--max-gaussians', '1500', '--backend', 'openmp',
  '--quiet');
console.log(`${seconds()} s  a capture and a model`);

const browser = await chromium.launch({
  executablePath,
  args: ['--headless', '--no-sandbox', '--host-resolver-rules=MAP *.test 127.0.0.1', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
const server = await gart.serve('view', 'run/model.ply', 'capture', '--backend', 'openmp');
const world = {gart, browser, server, work};

let failed = 0;
for (const [name, body] of Object.entries({...navigation, ...images, ...cameras, ...tools, ...paths, ...people, ...look, ...files, ...kept, ...scene, ...report, ...training})) {
  if (wanted.length && !wanted.some((word) => name.includes(word))) continue;
  const from = Date.now();
  try {
    await body(world);
    console.log(`${seconds()} s  ok      ${name} (${((Date.now() - from) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    console.log(`${seconds()} s  FAILED  ${name}\n${error.stack}`);
  }
}
await browser.close();
endAll();
if (failed) console.log(server.text());
console.log(failed ? `${failed} failed` : 'all passed');
process.exit(failed ? 1 : 0);
