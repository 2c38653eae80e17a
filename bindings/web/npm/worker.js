// Runs an Engine in a separate thread, in browsers and in Node.js. The first message that the
// worker receives is {open: [module, source, options]}. Then it receives a message {id, name,
// argument, watched} for each call, and {dropped: id} when the caller aborts the call with this id.
// It sends {id, result} or {id, error} at the end of a call, and {id, progress} during the call if
// `watched` is true.
import { Engine, buffersOf } from "./engine.js";
import { packed } from "./errors.js";

let engine;
const controllers = new Map();

async function take(post, { open, id, name, argument, watched, dropped }) {
  if (open !== undefined) {
    engine = new Engine(...open);
    return;
  }
  if (dropped !== undefined) {
    controllers.get(dropped)?.abort();
    return;
  }
  const controller = new AbortController();
  controllers.set(id, controller);
  try {
    const progress = watched ? (done) => post({ id, progress: done }) : undefined;
    const result = await engine.call(name, argument, { signal: controller.signal, progress });
    post({ id, result }, buffersOf(result));
  } catch (error) {
    post({ id, error: packed(error) });
  } finally {
    controllers.delete(id);
  }
}

if (typeof globalThis.postMessage === "function") {
  globalThis.onmessage = ({ data }) =>
    take((message, moved = []) => globalThis.postMessage(message, moved), data);
} else {
  const { parentPort } = await import("node:worker_threads");
  parentPort.on("message", (data) =>
    take((message, moved = []) => parentPort.postMessage(message, moved), data));
}
