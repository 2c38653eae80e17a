// What is shown in which colour: the colours of `shm preview` (converters/picture/colours.cpp), bit
// by bit. A colour is [red, green, blue], each 0..255.

// The palette of M. Okabe and K. Ito without its black, blue first.
const HUES = [[86, 180, 233], [230, 159, 0], [0, 158, 115], [240, 228, 66], [204, 121, 167],
  [213, 94, 0], [0, 114, 178]];

// Every seventeenth colour of viridis (N. Smith, S. van der Walt; CC0).
const VALUES = ["440154", "481a6c", "472f7d", "414487", "39568c", "31688e", "2a788e", "23888e",
  "1f988b", "22a884", "35b779", "54c568", "7ad151", "a5db36", "d2e21b", "fde725"].map((digits) =>
  [0, 2, 4].map((at) => Number.parseInt(digits.slice(at, at + 2), 16)));
const STEPS = 17; // from one to the next

/** Of what has no value. */
export const NO_VALUE = [150, 150, 150];

/** `part` of `of` from `a` to `b`. */
function between(a, b, part, of) {
  const half = Math.floor(of / 2);
  return a.map((from, i) => Math.floor((from * (of - part) + b[i] * part + half) / of));
}

/** After so many blocks colours come again. */
export const BLOCK_COLOURS = 3 * HUES.length;

/** Of an element block by its index: seven hues, then the same ones darker, then lighter. */
export function blockColour(block) {
  const hue = HUES[block % HUES.length];
  switch (Math.floor(block / HUES.length) % 3) {
    case 1: return between(hue, [0, 0, 0], 2, 5);
    case 2: return between(hue, [255, 255, 255], 1, 2);
    default: return hue;
  }
}

/** Of a value in 0..1 from the least to the greatest; NaN: NO_VALUE. */
export function valueColour(share) {
  if (Number.isNaN(share)) return NO_VALUE;
  const most = (VALUES.length - 1) * STEPS; // 255
  const place = Math.floor(Math.min(Math.max(share, 0), 1) * most + 0.5);
  const first = Math.min(Math.floor(place / STEPS), VALUES.length - 2);
  return between(VALUES[first], VALUES[first + 1], place - first * STEPS, STEPS);
}

/** The 256 colours of values, 4 bytes each, as a texture has them. */
export function valueTable() {
  const table = new Uint8Array(4 * 256).fill(255);
  for (let i = 0; i < 256; ++i) table.set(valueColour(i / 255), 4 * i);
  return table;
}
