// The data of the page: base64 of deflated bytes, a length, JSON and columns.
import { inflate } from "./inflate.js";
import { readColumn } from "./columns.js";

/** {about, column}: the JSON, and a function that reads a column once and keeps it. */
export async function unpack(text) {
  const bytes = await inflated(fromBase64(text.trim()));
  const size = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const about = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
  const numbers = bytes.subarray(4 + size), kept = new Map();
  const column = (where) => {
    const key = where.join(" "); // an empty column begins where the next one does
    if (!kept.has(key)) kept.set(key, readColumn(numbers, where));
    return kept.get(key);
  };
  return { about, column };
}

function fromBase64(text) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

async function inflated(packed) {
  if (typeof DecompressionStream === "undefined") return inflate(packed);
  try {
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  } catch (error) {
    if (error instanceof TypeError) return inflate(packed); // knows streams, but not "deflate-raw"
    throw error;
  }
}
