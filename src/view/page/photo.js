// The photograph beside the render of its camera: a divider that shows one on each side.

export function photoSplit(stage, image, divider, toggle) {
  let share = 0.5, on = false, index = null, rect = null;
  const place = () => {
    const shown = on && index !== null && rect !== null;
    image.hidden = divider.hidden = !shown;
    if (!shown) return;
    Object.assign(image.style, {left: `${rect.x}px`, top: `${rect.y}px`, width: `${rect.width}px`,
      height: `${rect.height}px`, clipPath: `inset(0 0 0 ${100 * share}%)`});
    Object.assign(divider.style, {left: `${rect.x + share * rect.width}px`, top: `${rect.y}px`, height: `${rect.height}px`});
    divider.setAttribute('aria-valuenow', Math.round(100 * share));
  };
  const to = (value) => {
    share = Math.min(1, Math.max(0, value));
    place();
  };
  divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener('pointermove', (event) => {
    if (event.buttons) to((event.clientX - stage.getBoundingClientRect().left - rect.x) / rect.width);
  });
  divider.addEventListener('keydown', (event) => {
    const by = {ArrowLeft: -0.02, ArrowRight: 0.02, PageUp: 0.2, PageDown: -0.2, Home: -1, End: 1}[event.key];
    if (by === undefined) return;
    to(share + by);
    event.preventDefault();
  });
  toggle.addEventListener('change', () => {
    on = toggle.checked;
    place();
  });
  return {
    // The photograph of the view's camera; null if the capture has no such camera or photograph.
    through(camera) {
      const next = camera?.photo ? camera.index : null;
      toggle.disabled = next === null;
      if (next !== null && next !== index) {
        image.src = `photo/${next}.jpg`;
        image.alt = `Photograph ${camera.name}`;
      }
      index = next;
      place();
    },
    layout(next) {
      rect = next;
      place();
    },
    show(value) {
      toggle.checked = on = value;
      place();
    },
  };
}
