// The built program: run to its end, or as a server whose addresses it prints.

import {execFile, spawn} from 'node:child_process';
import {promisify} from 'node:util';

const running = new Set();
const run = promisify(execFile);

export const gartAt = (program, folder) => ({
  folder,
  // Resolves with stdout; fails with stderr.
  run: async (...given) => (await run(program, given, {cwd: folder, maxBuffer: 1 << 26})).stdout,

  // {control, look, child, ended}: the two addresses, and a promise of the exit code. Left alone after 90 s.
  serve(...given) {
    const child = spawn(program, given, {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']});
    running.add(child);
    let text = '';
    const ended = new Promise((resolve) => child.on('exit', (code) => (running.delete(child), resolve(code))));
    return new Promise((resolve, reject) => {
      const late = setTimeout(() => reject(new Error(`gart ${given.join(' ')} printed no address:\n${text}`)), 90000);
      const read = (data) => {
        text += data;
        const found = text.match(/http:\/\/[^\s]+\/[0-9a-f]{32}\//g);
        if (!found || found.length < 2) return;
        clearTimeout(late);
        resolve({control: found[0], look: found[1], child, ended, text: () => text});
      };
      child.stdout.on('data', read);
      child.stderr.on('data', read);
      ended.then((code) => reject(new Error(`gart ${given.join(' ')} ended with ${code}:\n${text}`)));
    });
  },
});

export function endAll() {
  for (const child of running) child.kill('SIGKILL');
}
process.on('exit', endAll);
