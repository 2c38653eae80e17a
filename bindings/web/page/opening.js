// Opens files with the npm package shmformat. The page contains the decoder and the script of its
// worker; a page made by `shm view` also contains a file.
import { open } from "../npm/shmformat.js";

// The first bytes of every .shm file.
const SIGNATURE = [0x89, 0x53, 0x48, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];
const PIECE = 1 << 20; // number of base64 characters decoded at a time; a multiple of 4

/** Converts the base64 text of an HTML element to a Blob. Throws Error if the text is not valid
 *  base64. */
function blobOf(element, type) {
  const text = element.textContent.trim();
  const pieces = [];
  try {
    for (let begin = 0; begin < text.length; begin += PIECE) {
      pieces.push(Uint8Array.from(atob(text.slice(begin, begin + PIECE)),
        (one) => one.charCodeAt(0)));
    }
  } catch {
    throw new Error("this page is damaged: its embedded data is not valid base64");
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
/** Returns the URL of the script of the worker. In the page, the package calls this function
 *  (inline.py inserts the call) instead of loading the worker from a file. */
globalThis.shmWorkerUrl = () => {
  worker ??= URL.createObjectURL(
    new Blob([document.getElementById("worker").textContent], { type: "text/javascript" }));
  return worker;
};

/** Returns the file embedded in this page as {name, source}, or null if the page contains no
 *  file. */
export function fileInside() {
  const element = document.getElementById("file");
  if (element.textContent.trim() === "") return null;
  const source = blobOf(element, "application/octet-stream");
  element.textContent = "";
  return { name: element.dataset.name, source };
}

/** Throws an error unless the file begins with the signature of a .shm file. The decoder cannot
 *  make this check, because it reads the end of the file first. */
async function checkBeginning(file, name) {
  const first = new Uint8Array(await file.slice(0, SIGNATURE.length).arrayBuffer());
  if (first.length > 0 && SIGNATURE.some((byte, i) => byte !== first[i])) {
    throw new Error(`${name}: this is not a .shm file`);
  }
}

/** Opens a file with the npm package shmformat. Returns a Mesh or an Archive. `source` is a Blob or
 *  an absolute URL. */
export async function opened(source, name) {
  if (source instanceof Blob) await checkBeginning(source, name);
  return open(source, { wasm: await decoder() });
}
