// What the page tells its reader: read aloud, and where it is news shown over the view for some seconds.

const shownFor = 7000;  // milliseconds

export function notes(aloud, shown) {
  let timer = 0;
  return {
    aloud: (text) => (aloud.textContent = text),
    say(text) {
      aloud.textContent = shown.textContent = text;
      shown.hidden = false;
      clearTimeout(timer);
      timer = setTimeout(() => (shown.hidden = true), shownFor);
    },
  };
}
