// The screens that every control is used on: a desk, a phone, a phone on its side.

const phone = {hasTouch: true, isMobile: true};
export const screens = {
  'a desk': {viewport: {width: 1400, height: 900}},
  'a phone': {viewport: {width: 400, height: 800}, ...phone},
  'a phone on its side': {viewport: {width: 863, height: 360}, ...phone},
};

// A case for each of them: body(world, the page's options).
export const onEach = (cases) => Object.fromEntries(Object.entries(cases).flatMap(([name, body]) =>
  Object.entries(screens).map(([screen, options]) => [`${name}, on ${screen}`, (world) => body(world, options)])));
