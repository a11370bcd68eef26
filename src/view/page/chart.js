// A line chart on a canvas, in the colours of the page.

const left = 40, right = 8, top = 6, bottom = 18;

const short = (x) => (Math.abs(x) >= 1e4 ? `${Number((x / 1000).toPrecision(3))}k` : `${Number(x.toPrecision(3))}`);

function ticksOf(low, high, n) {
  const raw = (high - low) / n || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw);
  const ticks = [];
  for (let x = Math.ceil(low / step) * step; x <= high + 1e-9 * step; x += step) ticks.push(Number(x.toPrecision(12)));
  return ticks;
}

// 1, 2 and 5 of each power of ten; the powers alone where those are many.
function logTicks(low, high) {
  const steps = high - low > 2 ? [1] : [1, 2, 5], ticks = [];
  for (let power = Math.floor(low); power <= high; ++power)
    for (const k of steps) if (power + Math.log10(k) >= low && power + Math.log10(k) <= high) ticks.push(k * 10 ** power);
  return ticks;
}

export function drawChart(canvas, points, {color, logarithmic, dots, describe}) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  canvas.width = width * ratio, canvas.height = height * ratio;
  const draw = canvas.getContext('2d'), style = getComputedStyle(canvas);
  draw.scale(ratio, ratio);
  const good = points.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y) && (!logarithmic || y > 0));
  canvas.setAttribute('aria-label', good.length ? describe(good.at(-1)) : 'no points yet');
  if (good.length < 2) return;
  const to = logarithmic ? Math.log10 : (y) => y;
  let low = Math.min(...good.map((p) => to(p[1]))), high = Math.max(...good.map((p) => to(p[1])));
  const room = 0.05 * (high - low) || 0.5;
  low -= room, high += room;
  const last = good.at(-1)[0] || 1;
  const atX = (x) => left + (x / last) * (width - left - right);
  const atY = (y) => top + ((high - to(y)) / (high - low)) * (height - top - bottom);

  draw.font = '10.5px system-ui, sans-serif';
  draw.lineWidth = 1;
  const rule = style.getPropertyValue('--rule'), soft = style.getPropertyValue('--soft');
  const ticks = logarithmic ? logTicks(low, high) : ticksOf(low, high, 3);
  for (const t of ticks) {
    draw.strokeStyle = rule;
    draw.beginPath();
    draw.moveTo(left, atY(t));
    draw.lineTo(width - right, atY(t));
    draw.stroke();
    draw.fillStyle = soft;
    draw.textAlign = 'right';
    draw.fillText(short(t), left - 6, atY(t) + 3.5);
  }
  draw.textAlign = 'center';
  for (const t of ticksOf(0, last, 3)) draw.fillText(short(t), Math.min(atX(t), width - right - 10), height - 4);
  draw.strokeStyle = draw.fillStyle = style.getPropertyValue(color);
  draw.lineWidth = 1.6;
  draw.lineJoin = 'round';
  draw.beginPath();
  for (const [x, y] of good) draw.lineTo(atX(x), atY(y));
  draw.stroke();
  if (dots)
    for (const [x, y] of good) {
      draw.beginPath();
      draw.arc(atX(x), atY(y), 2.6, 0, 2 * Math.PI);
      draw.fill();
    }
}
