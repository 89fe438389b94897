// Decompression of deflate (RFC 1951), for browsers without DecompressionStream (before 2023).

const LENGTHS = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const DISTANCES = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145,
  8193, 12289, 16385, 24577];
const DISTANCE_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/** Return the decompressed bytes. Throws an Error if the input is not valid. */
export function inflate(data) {
  const bits = new BitReader(data);
  let out = new Uint8Array(data.length * 4 + 64);
  let size = 0;
  const room = (more) => {
    if (size + more <= out.length) return;
    const larger = new Uint8Array(Math.max(out.length * 2, size + more));
    larger.set(out);
    out = larger;
  };
  for (let last = 0; !last;) {
    last = bits.take(1);
    const kind = bits.take(2);
    if (kind === 0) {
      const stored = bits.stored();
      room(stored.length);
      out.set(stored, size);
      size += stored.length;
      continue;
    }
    if (kind === 3) throw new Error("not deflated");
    const [literals, distances] = kind === 1 ? fixedTables() : dynamicTables(bits);
    for (;;) {
      const symbol = bits.symbol(literals);
      if (symbol === 256) break;
      room(258);
      if (symbol < 256) {
        out[size++] = symbol;
        continue;
      }
      const length = LENGTHS[symbol - 257] + bits.take(LENGTH_BITS[symbol - 257]);
      const code = bits.symbol(distances);
      const distance = DISTANCES[code] + bits.take(DISTANCE_BITS[code]);
      if (distance > size) throw new Error("not deflated");
      for (let k = 0; k < length; k++, size++) out[size] = out[size - distance];
    }
  }
  return out.subarray(0, size);
}

class BitReader {
  constructor(data) {
    this.data = data;
    this.at = 0;
    this.held = 0;
    this.count = 0;
  }

  take(number) {
    while (this.count < number) {
      if (this.at >= this.data.length) throw new Error("cut short");
      this.held |= this.data[this.at++] << this.count;
      this.count += 8;
    }
    const value = this.held & ((1 << number) - 1);
    this.held >>>= number;
    this.count -= number;
    return value;
  }

  symbol({ counts, symbols }) {
    let code = 0, first = 0, index = 0;
    for (let length = 1; length < 16; length++) {
      code |= this.take(1);
      if (code - counts[length] < first) return symbols[index + (code - first)];
      index += counts[length];
      first = (first + counts[length]) << 1;
      code <<= 1;
    }
    throw new Error("not deflated");
  }

  stored() {
    this.held = this.count = 0;
    const length = this.data[this.at] | (this.data[this.at + 1] << 8);
    this.at += 4 + length;
    if (this.at > this.data.length) throw new Error("cut short");
    return this.data.subarray(this.at - length, this.at);
  }
}

function codeTable(lengths) {
  const counts = new Uint16Array(16), starts = new Uint16Array(16), symbols = new Uint16Array(lengths.length);
  for (const length of lengths) counts[length]++;
  counts[0] = 0;
  for (let length = 1; length < 15; length++) starts[length + 1] = starts[length] + counts[length];
  lengths.forEach((length, symbol) => {
    if (length) symbols[starts[length]++] = symbol;
  });
  return { counts, symbols };
}

function fixedTables() {
  const lengths = Array.from({ length: 288 }, (_, k) => (k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8));
  return [codeTable(lengths), codeTable(Array(30).fill(5))];
}

function dynamicTables(bits) {
  const literals = bits.take(5) + 257, distances = bits.take(5) + 1, given = bits.take(4) + 4;
  const short = Array(19).fill(0);
  for (let k = 0; k < given; k++) short[ORDER[k]] = bits.take(3);
  const table = codeTable(short), lengths = [];
  while (lengths.length < literals + distances) {
    const symbol = bits.symbol(table);
    if (symbol < 16) lengths.push(symbol);
    else if (symbol === 16) lengths.push(...Array(3 + bits.take(2)).fill(lengths[lengths.length - 1]));
    else lengths.push(...Array(symbol === 17 ? 3 + bits.take(3) : 11 + bits.take(7)).fill(0));
  }
  return [codeTable(lengths.slice(0, literals)), codeTable(lengths.slice(literals))];
}
