// The panel's tabs: arrow keys go to the next, and on a narrow screen the chosen one closes the sheet.

// Where style.css makes the panel a sheet below the view.
export const narrow = () => matchMedia('(max-width: 700px) and (orientation: portrait)').matches;

export function tabs(list, changed) {
  const all = [...list.querySelectorAll('[role=tab]')];
  const panelOf = (tab) => document.getElementById(tab.getAttribute('aria-controls'));
  const shown = () => all.filter((tab) => !tab.hidden);
  function choose(tab) {
    for (const one of all) {
      const on = one === tab;
      one.setAttribute('aria-selected', on);
      one.tabIndex = on || (!tab && one === shown()[0]) ? 0 : -1;
      panelOf(one).hidden = !on;
    }
    changed(Boolean(tab));
  }
  for (const tab of all)
    tab.addEventListener('click', () => {
      const again = tab.getAttribute('aria-selected') === 'true' && narrow();
      choose(again ? null : tab);
    });
  list.addEventListener('keydown', (event) => {
    const by = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key], open = shown();
    const at = open.indexOf(document.activeElement);
    if (!by || at < 0) return;
    const next = open[(at + by + open.length) % open.length];
    next.focus();
    choose(next);
    event.preventDefault();
  });
  return {
    choose: (name) => choose(name ? all.find((tab) => tab.id === `tab-${name}`) : null),
    offer: (name, is) => (all.find((tab) => tab.id === `tab-${name}`).hidden = !is),
  };
}
