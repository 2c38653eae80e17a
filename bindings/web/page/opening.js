// What is in the page beside its script: the decoder, the script of its worker, and maybe a file
// (`shm view`). And what opens a file with them.
import { open } from "../npm/shmformat.js";

// Of every .shm file.
const SIGNATURE = [0x89, 0x53, 0x48, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];
const PIECE = 1 << 20; // characters of base64 at a time; a multiple of 4

/** Base64 of an element as a Blob. Throws Error where it is none. */
function blobOf(element, type) {
  const text = element.textContent.trim();
  const pieces = [];
  try {
    for (let at = 0; at < text.length; at += PIECE) {
      pieces.push(Uint8Array.from(atob(text.slice(at, at + PIECE)), (one) => one.charCodeAt(0)));
    }
  } catch {
    throw new Error("this page is damaged: what is in it is no base64");
  }
  return new Blob(pieces, { type });
}

let module;
function decoder() {
  module ??= (async () => {
    const packed = blobOf(document.getElementById("decoder"), "application/gzip");
    const bytes = packed.stream().pipeThrough(new DecompressionStream("gzip"));
    return WebAssembly.compile(await new Response(bytes).arrayBuffer());
  })();
  return module;
}

let worker;
/** Where the package's worker is, which it has in a file of its own: inline.py puts this call
 *  there. */
globalThis.shmWorkerUrl = () => {
  worker ??= URL.createObjectURL(
    new Blob([document.getElementById("worker").textContent], { type: "text/javascript" }));
  return worker;
};

/** The file that is in this page, as {name, source}; null: there is none. */
export function fileInside() {
  const element = document.getElementById("file");
  if (element.textContent.trim() === "") return null;
  const source = blobOf(element, "application/octet-stream");
  element.textContent = "";
  return { name: element.dataset.name, source };
}

/** A file of another kind says so at its beginning; the decoder begins at the end. */
async function checkBeginning(file, name) {
  const first = new Uint8Array(await file.slice(0, SIGNATURE.length).arrayBuffer());
  if (first.length > 0 && SIGNATURE.some((byte, i) => byte !== first[i])) {
    throw new Error(`${name}: this is no .shm file`);
  }
}

/** A Mesh or an Archive of the package. `source`: a Blob, or a URL that is whole. */
export async function opened(source, name) {
  if (source instanceof Blob) await checkBeginning(source, name);
  return open(source, { wasm: await decoder() });
}
