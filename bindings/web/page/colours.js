// Colours of the page. They are exactly the colours of `shm preview`
// (converters/picture/colours.cpp). A colour is [red, green, blue], each 0..255.

// The palette of M. Okabe and K. Ito without black. The first colour is sky blue.
const HUES = [[86, 180, 233], [230, 159, 0], [0, 158, 115], [240, 228, 66], [204, 121, 167],
  [213, 94, 0], [0, 114, 178]];

// Every 17th of the 256 colours of viridis (N. Smith, S. van der Walt; CC0).
const VALUES = ["440154", "481a6c", "472f7d", "414487", "39568c", "31688e", "2a788e", "23888e",
  "1f988b", "22a884", "35b779", "54c568", "7ad151", "a5db36", "d2e21b", "fde725"].map((digits) =>
  [0, 2, 4].map((index) => Number.parseInt(digits.slice(index, index + 2), 16)));
const STEPS = 17; // number of interpolation steps between two adjacent colours of VALUES

/** Colour of elements without a value. */
export const NO_VALUE = [150, 150, 150];

/** Interpolates between the colours `a` and `b`: returns the colour at the fraction `part` / `of`
 *  of the way from `a` to `b`. */
function between(a, b, part, of) {
  const half = Math.floor(of / 2);
  return a.map((from, i) => Math.floor((from * (of - part) + b[i] * part + half) / of));
}

/** Number of different block colours; block colours repeat after this number. */
export const BLOCK_COLOURS = 3 * HUES.length;

/** Returns the colour of the block with this index. Blocks 0 to 6 have seven hues, blocks 7 to 13
 *  have darker versions of these hues, and blocks 14 to 20 have lighter versions. */
export function blockColour(block) {
  const hue = HUES[block % HUES.length];
  switch (Math.floor(block / HUES.length) % 3) {
    case 1: return between(hue, [0, 0, 0], 2, 5);
    case 2: return between(hue, [255, 255, 255], 1, 2);
    default: return hue;
  }
}

/** Returns the colour of a scaled value, 0..1. Returns NO_VALUE for NaN. */
export function valueColour(share) {
  if (Number.isNaN(share)) return NO_VALUE;
  const most = (VALUES.length - 1) * STEPS; // 255
  const place = Math.floor(Math.min(Math.max(share, 0), 1) * most + 0.5);
  const first = Math.min(Math.floor(place / STEPS), VALUES.length - 2);
  return between(VALUES[first], VALUES[first + 1], place - first * STEPS, STEPS);
}

/** Returns a texture with the colours of 256 evenly spaced values, 4 bytes per colour. */
export function valueTable() {
  const table = new Uint8Array(4 * 256).fill(255);
  for (let i = 0; i < 256; ++i) table.set(valueColour(i / 255), 4 * i);
  return table;
}
