// A video of the canvas while the path plays, by the browser's MediaRecorder. It has what the canvas showed, in real
// time; every frame at full resolution is for `gart render --path`.

import {saveFile} from './files.js';

const kinds = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/mp4', 'video/webm'];

export function recorder(button, canvas, play, say) {
  const type = globalThis.MediaRecorder && kinds.find((kind) => MediaRecorder.isTypeSupported(kind));
  if (!type) button.title = 'This browser does not record video.';
  button.addEventListener('click', async () => {
    if (!type) return say('This browser does not record video. Save the path, and use gart render --path.');
    const parts = [], tape = new MediaRecorder(canvas.captureStream(30), {mimeType: type, videoBitsPerSecond: 12e6});
    tape.ondataavailable = ({data}) => data.size && parts.push(data);
    const done = new Promise((resolve) => (tape.onstop = resolve));
    tape.start();
    button.setAttribute('aria-pressed', true);
    await play();
    tape.stop();
    await done;
    tape.stream.getTracks().forEach((track) => track.stop());
    button.setAttribute('aria-pressed', false);
    saveFile(`gart.${type.includes('mp4') ? 'mp4' : 'webm'}`, new Blob(parts, {type}));
    say('The video is saved.');
  });
}
