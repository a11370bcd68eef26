// The training behind the view: its progress, curves, and buttons for those who may control it.

import {drawChart} from './chart.js';

const mostPoints = 600;

export function trainingPanel(ui, send, say) {
  let loss = [], test = [], paused = false, last = null;

  function draw() {
    drawChart(ui.loss, loss, {color: '--one', logarithmic: true,
      describe: ([step, y]) => `Training loss, ${y.toPrecision(3)} at step ${step}`});
    drawChart(ui.test, test, {color: '--two', dots: true,
      describe: ([step, y]) => `Test PSNR, ${y.toFixed(2)} dB at step ${step}`});
    ui.lossNow.textContent = loss.length ? loss.at(-1)[1].toPrecision(3) : '–';
    ui.testNow.textContent = test.length ? `${test.at(-1)[1].toFixed(2)} dB` : '–';
  }
  const act = (action, said) => say(send({type: 'train', action}) ? said : 'There is no connection.');
  ui.pause.addEventListener('click', () => act(paused ? 'resume' : 'pause', paused ? 'It is asked to go on …' : 'It is asked to pause …'));
  ui.step.addEventListener('click', () => act('step', 'One step …'));
  ui.save.addEventListener('click', () => act('save', 'It is asked to save …'));
  ui.stop.addEventListener('click', () => ui.sure.showModal());
  ui.sure.addEventListener('close', () => ui.sure.returnValue === 'stop' && act('stop', 'It is asked to stop …'));
  ui.share.addEventListener('change', () => send({type: 'share', value: Number(ui.share.value)}));
  ui.share.addEventListener('input', () => (ui.shareNow.textContent = percent(ui.share.value)));
  const percent = (x) => `${Math.round(100 * x)} %`;

  return {
    rights(right) {
      const may = right === 'control';
      for (const b of [ui.pause, ui.step, ui.save, ui.stop, ui.share]) b.disabled = !may;
      ui.onlooker.hidden = may;
    },
    curve(message) {
      loss = message.loss, test = message.test;
      draw();
    },
    status(s) {
      ui.progress.max = s.of;
      ui.progress.value = s.step;
      ui.at.textContent = `${s.step.toLocaleString('en')} of ${s.of.toLocaleString('en')}`;
      ui.rate.textContent = s.paused ? 'paused' : `${s.steps_per_second.toFixed(1)} /s`;
      ui.gaussians.textContent = s.gaussians.toLocaleString('en');
      ui.pause.textContent = s.paused ? 'Resume' : 'Pause';
      ui.step.hidden = !s.paused;
      if (last && s.paused !== paused) say(s.paused ? 'Training is paused.' : 'Training goes on.');
      paused = s.paused;
      if (document.activeElement !== ui.share) {
        ui.share.value = s.view_share;
        ui.shareNow.textContent = percent(s.view_share);
      }
      if (Number.isFinite(s.loss) && s.step > (loss.at(-1)?.[0] ?? 0)) {
        loss.push([s.step, s.loss]);
        if (loss.length > 2 * mostPoints) loss = loss.filter((_, i) => i % 2 === 0 || i === loss.length - 1);
      }
      last = s;
      draw();
    },
    draw,
  };
}
