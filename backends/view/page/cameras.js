// The capture's cameras as a list to choose from.

export function cameraList(ui, jump) {
  let cameras = [], current = null;
  const buttons = new Map();
  function fill(all) {
    cameras = all;
    buttons.clear();
    ui.list.replaceChildren(...cameras.map((camera) => {
      const item = document.createElement('li'), button = document.createElement('button');
      button.type = 'button';
      button.className = 'wide';
      button.append(camera.name);
      if (camera.test) button.append(Object.assign(document.createElement('small'), {textContent: 'test'}));
      button.addEventListener('click', () => jump(camera));
      item.append(button);
      buttons.set(camera.index, button);
      return item;
    }));
    filter();
    mark(current);
  }
  const filter = () => {
    const words = ui.find.value.toLowerCase().split(' ').filter(Boolean);
    for (const camera of cameras) {
      const text = `${camera.name} ${camera.test ? 'test' : ''}`.toLowerCase();
      buttons.get(camera.index).parentElement.hidden = !words.every((word) => text.includes(word));
    }
  };
  function mark(index) {
    if (index !== null) current = index;
    for (const [i, button] of buttons) button.setAttribute('aria-current', i === index);
    buttons.get(index)?.scrollIntoView({block: 'nearest'});
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
  return {fill, mark, next};
}
