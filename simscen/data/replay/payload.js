// Data of the page: base64 of compressed bytes, which are the length of a JSON document, the document, and arrays.
import { inflate } from "./inflate.js";
import { readColumn } from "./columns.js";

/** Return {about, column}: the JSON document, and a function that decodes an array and caches it. */
export async function unpack(text) {
  const bytes = await inflated(fromBase64(text.trim()));
  const size = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const about = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
  const numbers = bytes.subarray(4 + size), kept = new Map();
  const column = (where) => {
    const key = where.join(" "); // an empty array has the same offset as the next one
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
    if (error instanceof TypeError) return inflate(packed); // the browser has DecompressionStream, but without "deflate-raw"
    throw error;
  }
}
