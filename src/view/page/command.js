// The command that writes the shown part of the model: the crop box, and the scale of a known length.

const number = (x) => String(Number(x.toPrecision(9)));  // what tells floats apart

export function convertCommand(model, crop, scale) {
  const stem = model.replace(/\.[^.]*$/, '');
  const words = ['gart convert', quoted(model), quoted(`${stem}-part.ply`)];
  if (crop) words.push(`--crop=${[...crop.min, ...crop.max].map(number).join(',')}`);
  if (scale !== 1) words.push(`--transform 1,0,0,0,0,0,0,${number(scale)}`);
  return words.join(' ');
}

const quoted = (name) => (/^[\w.,=+-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);

export function commandPanel(ui, say) {
  ui.copy.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(ui.text.textContent);
      say('The command is copied.');
    } catch {
      getSelection().selectAllChildren(ui.text);
      say('The browser lets no page copy here: the command is selected.');
    }
  });
  return {
    write(model, crop, scale) {
      ui.part.hidden = !crop && scale === 1;
      ui.text.textContent = convertCommand(model, crop, scale);
    },
  };
}
