// The list of the capture's cameras, with thumbnails and scores.

export function cameraList(ui, jump) {
  let cameras = [], current = null;
  const rows = new Map();
  const element = (name, values) => Object.assign(document.createElement(name), values);

  function fill(all) {
    cameras = all;
    rows.clear();
    ui.list.replaceChildren(...cameras.map((camera) => {
      const item = element('li'), button = element('button', {type: 'button', className: 'wide'}), score = element('small');
      if (camera.photo) button.append(element('img', {src: `thumb/${camera.index}.jpg`, alt: '', loading: 'lazy', draggable: false}));
      button.append(element('span', {textContent: camera.name}));
      if (camera.test) button.append(element('small', {textContent: 'test'}));
      button.append(score);
      button.addEventListener('click', () => jump(camera));
      item.append(button);
      rows.set(camera.index, {item, button, score});
      return item;
    }));
    filter();
    mark(current);
  }
  const filter = () => {
    const words = ui.find.value.toLowerCase().split(' ').filter(Boolean);
    for (const camera of cameras) {
      const text = `${camera.name} ${camera.test ? 'test' : ''}`.toLowerCase();
      rows.get(camera.index).item.hidden = !words.every((word) => text.includes(word));
    }
  };
  function mark(index) {
    if (index !== null) current = index;
    for (const [i, {button}] of rows) button.setAttribute('aria-current', i === index);
    rows.get(index)?.button.scrollIntoView({block: 'nearest'});
  }
  function scores(all) {
    const psnr = new Map(all);
    for (const [i, {score}] of rows) score.textContent = psnr.has(i) ? `${psnr.get(i).toFixed(2)} dB` : '';
  }
  // From the last one that was looked through, round the list.
  function next(by) {
    if (!cameras.length) return;
    const at = cameras.findIndex((camera) => camera.index === current);
    jump(cameras[at < 0 ? 0 : (at + by + cameras.length) % cameras.length]);
  }
  ui.find.addEventListener('input', filter);
  ui.previous.addEventListener('click', () => next(-1));
  ui.next.addEventListener('click', () => next(1));
  return {fill, mark, next, scores};
}
