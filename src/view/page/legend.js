// What the colours of a mode stand for. The stops are those of `gart render --images` and of report.html.

const near = ['#faf28c', '#f58c40', '#9e3880', '#1a1452'];
const error = ['#0a081a', '#4a1460', '#962660', '#da4c3e', '#f99536', '#fcf0aa'];

export const modes = {
  colour: {title: 'Colour'},
  depth: {title: 'Depth', stops: near, unit: 'distance along the ray'},
  normal: {title: 'Normal', note: 'Red, green and blue: the normal’s x, y and z in the world, from −1 to 1'},
  alpha: {title: 'Alpha', stops: ['#000', '#fff'], unit: 'share of the light that the Gaussians hold', range: [0, 1]},
  hits: {title: 'Hits', stops: near, unit: 'Gaussians that a ray met'},
  error: {title: 'Error', stops: error, unit: 'mean difference from the photograph, of 1'},
  features: {title: 'Features', stops: near},
};

const short = (x) => (x === 0 ? '0' : Math.abs(x) >= 1000 ? Math.round(x).toString() : Number(x.toPrecision(3)).toString());

// of: {stops, unit, note} in place of the mode's own.
export function showLegend(legend, mode, frameScale, of = {}) {
  const {stops, unit, note, range} = {...modes[mode], ...of}, [low, high] = range ?? frameScale ?? [0, 1];
  legend.hidden = !stops && !note;
  if (legend.hidden) return;
  const [bar, from, to, what] = ['bar', 'from', 'to', 'what'].map((name) => legend.querySelector(`.${name}`));
  bar.hidden = from.hidden = to.hidden = !stops;
  what.textContent = note ?? unit;
  if (!stops) return;
  bar.style.background = `linear-gradient(90deg, ${stops.join(', ')})`;
  from.textContent = short(low);
  to.textContent = short(high);
}
