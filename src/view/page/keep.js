// What outlives a reload of the page: kept by the browser for this tab, this address and one model.

const key = `gart ${location.pathname}`;

export function kept(model) {
  try {
    const all = JSON.parse(sessionStorage.getItem(key));
    return all?.model === model ? all : null;
  } catch {
    return null;
  }
}

export function keep(model, parts) {
  try {
    sessionStorage.setItem(key, JSON.stringify({model, ...parts}));
  } catch {
    // A browser that keeps nothing begins anew.
  }
}
