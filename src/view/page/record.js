// A video of the canvas while the path plays, by the browser's MediaRecorder. It has what the canvas showed, in real
// time; every frame at full resolution is for `gart render --path`.

import {saveFile} from './files.js';

// The one that is cheapest to encode first: gart may be tracing on the same processor.
const kinds = ['video/webm;codecs=vp8', 'video/webm;codecs=vp9', 'video/mp4', 'video/webm'];
const askEvery = 100;       // milliseconds
const longestWait = 10000;  // milliseconds, for what is still being encoded

const passed = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// No step of a recorder is waited for longer: what it has by then is the video.
const inTime = (step) => Promise.race([step, passed(longestWait)]);

// play() ends when the path has, and whole() when the last view of it is on the canvas at full resolution.
export function recorder(button, canvas, {play, whole}, say) {
  const type = globalThis.MediaRecorder && kinds.find((kind) => MediaRecorder.isTypeSupported(kind));
  if (!type) button.title = 'This browser does not record video.';

  async function record() {
    const parts = [], tape = new MediaRecorder(canvas.captureStream(30), {mimeType: type, videoBitsPerSecond: 12e6});
    const heard = (name) => new Promise((resolve, reject) => {
      tape.addEventListener(name, resolve, {once: true});
      tape.addEventListener('error', () => reject(new Error('its recorder failed')), {once: true});
    });
    tape.addEventListener('dataavailable', ({data}) => data.size && parts.push(data));
    const started = heard('start');
    tape.start();
    await inTime(started);
    await play();
    await inTime(whole());
    // Frames still being encoded when the recorder stops are lost; on a slow machine all of them. So it goes on until
    // the last frame has come, and nothing after it.
    const begun = parts.length;
    for (const end = performance.now() + longestWait; performance.now() < end;) {
      const before = parts.length, answer = heard('dataavailable');
      tape.requestData();
      await inTime(answer);
      if (parts.length === before && before > begun) break;
      await passed(askEvery);
    }
    const stopped = heard('stop');
    tape.stop();
    await inTime(stopped);
    tape.stream.getTracks().forEach((track) => track.stop());
    return new Blob(parts, {type});
  }

  button.addEventListener('click', async () => {
    if (!type) return say('This browser does not record video. Save the path, and use gart render --path.');
    if (button.getAttribute('aria-pressed') === 'true') return;
    button.setAttribute('aria-pressed', true);
    try {
      const video = await record();
      if (!video.size) return say('The browser recorded no frame. Save the path, and use gart render --path.');
      saveFile(`gart.${type.includes('mp4') ? 'mp4' : 'webm'}`, video);
      say('The video is saved.');
    } catch (fault) {
      say(`The browser could not record: ${fault.message}`);
    } finally {
      button.setAttribute('aria-pressed', false);
    }
  });
}
