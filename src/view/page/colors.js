// Colours as three numbers from 0 to 1, and as a field of colours has them.

export const hex = (color) => `#${color.map((c) => Math.round(255 * c).toString(16).padStart(2, '0')).join('')}`;
export const colorOf = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
