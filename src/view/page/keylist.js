// Keyframes as rows of a list: look through one, its time, one place up, away.

// keys: [{camera, time}]. on: show(key), move(from, to), remove(i), time(i, seconds).
export function keyRows(list, keys, timed, on) {
  const button = (text, label, action) => {
    const b = Object.assign(document.createElement('button'), {type: 'button', textContent: text});
    b.setAttribute('aria-label', label);
    b.addEventListener('click', action);
    return b;
  };
  list.replaceChildren(...keys.map((key, i) => {
    const item = document.createElement('li'), n = i + 1;
    const go = button(`Keyframe ${n}`, `Go to keyframe ${n}`, () => on.show(key));
    go.className = 'wide';
    item.append(go);
    if (timed) {
      const time = Object.assign(document.createElement('input'), {type: 'number', min: 0, step: 'any', value: Number(key.time.toFixed(3))});
      time.setAttribute('aria-label', `Second at which the path passes keyframe ${n}`);
      time.addEventListener('change', () => on.time(i, time.valueAsNumber));
      item.append(time);
    }
    item.append(button('↑', `Move keyframe ${n} up`, () => i > 0 && on.move(i, i - 1)),
      button('×', `Remove keyframe ${n}`, () => on.remove(i)));
    return item;
  }));
}
