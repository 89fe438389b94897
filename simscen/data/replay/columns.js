// Decoding of the arrays that report/replay/packed_columns.py encodes: differences of multiples of a step, as varints.

export const LARGEST = 2 ** 30;

/** Return the numbers of an array [offset, count, step], including infinity and nan. */
export function readColumn(bytes, [begin, count, step]) {
  const values = new Float64Array(count);
  let at = begin, whole = 0;
  for (let k = 0; k < count; k++) {
    let coded = bytes[at++], scale = 128;
    if (coded > 127) {
      coded -= 128;
      for (let more = 128; more > 127; scale *= 128) {
        more = bytes[at++];
        coded += (more & 127) * scale;
      }
    }
    whole += coded % 2 ? -(coded + 1) / 2 : coded / 2;
    values[k] = whole > LARGEST ? NaN : whole === LARGEST ? Infinity : whole === -LARGEST ? -Infinity : whole * step;
  }
  return values;
}
