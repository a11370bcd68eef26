// Mouse, fingers and keys on the stage, as motions: `moves.turn`, `shift`, `zoom`, `step` (units a second, while held),
// and `tap` where something was pointed at and not moved. What the hand does on a handle goes to `moves.grab` first.

const still = 5;  // pixels that a tap may wander
const turnPerPixel = 0.006;

export function listenTo(stage, moves) {
  const pointers = new Map();
  let travelled = 0, unused = [0, 0], pinch = null, held = null, lastTap = {time: 0, x: 0, y: 0};
  const at = (event) => {
    const box = stage.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  };
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y)};
  };

  stage.addEventListener('pointerdown', (event) => {
    if (event.target.closest('[data-own-drag]')) return;
    stage.setPointerCapture(event.pointerId);
    stage.focus({preventScroll: true});
    pointers.set(event.pointerId, at(event));
    if (pointers.size === 1) travelled = 0, unused = [0, 0], held = moves.grab(at(event));
    pinch = pointers.size === 2 ? spread() : null;
  });

  stage.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId), now = at(event);
    if (!before) return moves.hover(now);
    const dx = now.x - before.x, dy = now.y - before.y;
    pointers.set(event.pointerId, now);
    travelled += Math.hypot(dx, dy);
    if (pointers.size === 1) unused = [unused[0] + dx, unused[1] + dy];
    if (travelled < still) return;
    if (pointers.size === 2 && pinch) {
      const next = spread();
      if (next.size > 0 && pinch.size > 0) moves.zoom(pinch.size / next.size);
      moves.shift([next.x - pinch.x, next.y - pinch.y]);
      pinch = next;
    } else if (pointers.size === 1 && held) {
      held.drag(now, unused);
      unused = [0, 0];
    } else if (pointers.size === 1) {
      const shifts = event.shiftKey || event.buttons & 6;
      if (shifts) moves.shift([dx, dy]);
      else moves.turn([dx * turnPerPixel, dy * turnPerPixel]);
    }
  });

  const lifted = (event) => {
    const alone = pointers.size === 1 && pointers.delete(event.pointerId);
    pointers.delete(event.pointerId);
    pinch = null;
    if (held && !pointers.size) held = (held.drop?.(), null);
    else if (alone && event.type === 'pointerup' && travelled < still) tapped(at(event));
  };
  const tapped = (place) => {
    const again = performance.now() - lastTap.time < 350 && Math.hypot(place.x - lastTap.x, place.y - lastTap.y) < 20;
    lastTap = {time: again ? 0 : performance.now(), ...place};
    (again ? moves.doubleTap : moves.tap)(place);
  };
  stage.addEventListener('pointerup', lifted);
  stage.addEventListener('pointercancel', lifted);
  stage.addEventListener('contextmenu', (event) => event.preventDefault());

  stage.addEventListener('wheel', (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 20 : 1;
    moves.zoom(Math.exp(Math.max(-120, Math.min(120, event.deltaY * lines)) * 0.0018));
  }, {passive: false});

  listenToKeys(stage, moves);
}

// Held keys move at an even rate however often the browser repeats them.
const heldKeys = {
  w: ['step', 0, 0, 1], s: ['step', 0, 0, -1], a: ['step', -1, 0, 0], d: ['step', 1, 0, 0],
  e: ['step', 0, -1, 0], q: ['step', 0, 1, 0],
  ArrowLeft: ['turn', 1, 0], ArrowRight: ['turn', -1, 0], ArrowUp: ['turn', 0, 1], ArrowDown: ['turn', 0, -1],
  '+': ['zoom', -1], '=': ['zoom', -1], '-': ['zoom', 1],
};

function listenToKeys(stage, moves) {
  const down = new Map();
  let last = 0, fast = false, ticking = false;

  function tick(time) {
    if (!down.size) return void (ticking = false);
    const seconds = Math.min(0.1, (time - last) / 1000) * (fast ? 3 : 1);
    last = time;
    const sum = {step: [0, 0, 0], turn: [0, 0], zoom: [0]};
    for (const [kind, ...amounts] of down.values()) amounts.forEach((x, i) => (sum[kind][i] += x * seconds));
    if (sum.step.some(Boolean)) moves.step(sum.step);
    if (sum.turn.some(Boolean)) moves.turn(sum.turn.map((x) => 1.1 * x));
    if (sum.zoom[0]) moves.zoom(Math.exp(sum.zoom[0]));
    requestAnimationFrame(tick);
  }

  stage.addEventListener('keydown', (event) => {
    fast = event.shiftKey;
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== stage) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (heldKeys[name]) {
      down.set(event.code, heldKeys[name]);
      if (!ticking) ticking = true, last = performance.now() - 16, requestAnimationFrame(tick);
    } else if (!event.repeat && !moves.key(name)) {
      return;
    }
    event.preventDefault();
  });
  stage.addEventListener('keyup', (event) => {
    fast = event.shiftKey;
    down.delete(event.code);
  });
  stage.addEventListener('blur', () => down.clear());
}
