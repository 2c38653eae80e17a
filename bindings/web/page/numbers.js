// Converts numbers and names to human-readable text. The results do not depend on the locale.

/** Formats a value with six significant digits, as printf("%g") does. */
export function valueText(value) {
  if (Number.isNaN(value)) return "no number";
  if (!Number.isFinite(value)) return value < 0 ? "-inf" : "inf";
  if (value === 0) return "0";
  const [digits, exponent] = value.toExponential(5).split("e");
  const power = Number(exponent);
  const plain = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (power >= -4 && power < 6) return plain(value.toFixed(5 - power));
  const sign = power < 0 ? "-" : "+";
  return `${plain(digits)}e${sign}${String(Math.abs(power)).padStart(2, "0")}`;
}

/** Formats a count (a Number or a BigInt), e.g. "1,234,567". */
export function countText(count) {
  return String(count).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** Returns a count together with the singular or plural of a noun, e.g. "1 cell" or "2 cells". */
export function plural(count, one, many) {
  return `${countText(count)} ${count === 1 ? one : many}`;
}

/** Formats a size in decimal units, e.g. "940 bytes" or "12.3 kB". */
export function bytesText(bytes) {
  if (bytes < 1000) return plural(bytes, "byte", "bytes");
  let size = bytes / 1000;
  let unit = 0;
  while (size >= 999.5 && unit < 3) {
    size /= 1000;
    ++unit;
  }
  const digits = size < 9.995 ? 2 : size < 99.95 ? 1 : 0;
  return `${size.toFixed(digits)} ${["kB", "MB", "GB", "TB"][unit]}`;
}

/** Formats a name from a file so that it fits on one line. Control characters and characters that
 *  change the text direction become escapes; long names are cut. */
export function nameText(name, most = 80) {
  const shown = Array.from(name, (one) => (/[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/u.test(one)
    ? `\\u${one.codePointAt(0).toString(16).padStart(4, "0")}` : one));
  return shown.length <= most ? shown.join("") : `${shown.slice(0, most - 1).join("")}…`;
}
