// The models that gart may open in place of this one.

export function modelList(ui, open) {
  ui.list.addEventListener('change', () => open(Number(ui.list.value), ui.list.selectedOptions[0].textContent));
  return {
    fill(names, current) {
      ui.part.hidden = names.length < 2;
      ui.list.replaceChildren(...names.map((name, i) => Object.assign(document.createElement('option'), {value: i, textContent: name})));
      if (names.length) ui.list.value = current;
    },
  };
}
