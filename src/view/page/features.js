// Which features of the Gaussians are shown, and what their colours stand for: one by a colour scale, three as red,
// green and blue, or the first three principal directions of all.

const places = {directions: 0, one: 1, three: 3};

// For the legend. chosen: as value() gives it, of so many features.
export const featureLegend = (chosen, count) => (chosen?.length === 1
  ? {unit: `feature ${chosen[0]}, mean along the ray`}
  : {stops: null, note: `Red, green and blue: ${chosen ? `features ${chosen.join(', ')}` : `the first three principal directions of ${count} features`}`});

// changed(): other features are wanted.
export function featurePanel(ui, changed) {
  let count = 0, chosen = null;
  const inputs = [0, 1, 2].map((i) => {
    const input = Object.assign(document.createElement('input'), {type: 'number', min: 0, step: 1});
    input.addEventListener('change', () => {
      const k = input.valueAsNumber;
      if (Number.isInteger(k) && k >= 0 && k < count) set(chosen.with(i, k));
      else write();
    });
    ui.places.append(input);
    return input;
  });
  ui.kind.addEventListener('change', () => {
    const wanted = places[ui.kind.value];
    set(wanted ? Array.from({length: wanted}, (_, i) => chosen?.[i] ?? Math.min(i, count - 1)) : null);
  });
  const set = (value) => {
    chosen = value;
    write();
    changed();
  };
  function write() {
    ui.kind.value = !chosen ? 'directions' : chosen.length === 1 ? 'one' : 'three';
    ui.kind.querySelector('[value=directions]').disabled = count < 3;
    ui.places.hidden = !chosen;
    inputs.forEach((input, i) => {
      input.max = count - 1;
      input.hidden = !(chosen?.length > i);
      input.value = chosen?.[i] ?? '';
      input.setAttribute('aria-label', chosen?.length === 1 ? 'Number of the feature' : `Feature for ${['red', 'green', 'blue'][i]}`);
    });
  }
  return {
    value: () => chosen,
    count: () => count,
    // Of another model, with what was chosen for it before, if anything.
    restore(features, before) {
      count = features, chosen = before ?? (count < 3 ? [0] : null);
      write();
    },
    show: (is) => (ui.part.hidden = !is),
  };
}
