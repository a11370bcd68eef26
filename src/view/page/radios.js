// A row of choices of which one holds, as radio buttons: arrow keys and screen readers know them.

export function radios(group, name, titles, chosen) {
  const inputs = {};
  for (const [value, title] of Object.entries(titles)) {
    const label = document.createElement('label'), text = document.createElement('span');
    const input = Object.assign(document.createElement('input'), {type: 'radio', name, value});
    input.addEventListener('change', () => chosen(value));
    text.textContent = title;
    label.append(input, text);
    group.append(label);
    inputs[value] = input;
  }
  return {
    set: (value) => (inputs[value].checked = true),
    offer: (has) => {
      for (const [value, input] of Object.entries(inputs)) input.parentElement.hidden = !has(value);
    },
  };
}
