// The view as a PNG, at any size, rendered by gart for it.

import {saveFile} from './files.js';

const mostPixels = 40e6, mostSide = 16384;

// page: size() of the stage in pixels, image({width, height}) -> a promise of {header, file}, name() of the model.
export function imagePanel(ui, page, say) {
  const size = () => ({width: ui.width.valueAsNumber, height: ui.height.valueAsNumber});
  const fault = ({width, height}) => {
    if (![width, height].every((n) => Number.isInteger(n) && n >= 1 && n <= mostSide))
      return `Width and height are whole numbers from 1 to ${mostSide}.`;
    return width * height > mostPixels ? 'An image has at most 40 million pixels.' : '';
  };
  ui.like.addEventListener('click', () => {
    const {width, height} = page.size();
    ui.width.value = width, ui.height.value = height;
  });
  ui.save.addEventListener('click', async () => {
    const wanted = size(), wrong = fault(wanted);
    if (wrong) return say(wrong);
    ui.save.disabled = true;
    say(`Rendering ${wanted.width} × ${wanted.height} …`);
    try {
      const {header, file} = await page.image(wanted);
      saveFile(`${page.name().replace(/\.[^.]*$/, '')}-${header.width}x${header.height}.png`, file);
      say(`The image is saved, ${header.width} × ${header.height}.`);
    } catch (failed) {
      say(failed.message);
    }
    ui.save.disabled = false;
  });
}
