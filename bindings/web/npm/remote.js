// Remote: an open file whose Engine runs in a worker. A Remote has the same method call() as an
// Engine.
import { ShmError, unpacked } from "./errors.js";

export class Remote {
  /** The arguments are those of the constructor of Engine. */
  constructor(...open) {
    this.open = open;
    this.calls = new Map(); // pending calls by id, the oldest first
    this.ids = 0;
    this.worker = null;
    this.ended = false;
  }

  static canBe() {
    return typeof Worker === "function" || globalThis.process?.versions?.node !== undefined;
  }

  async call(name, argument, { signal, progress } = {}) {
    if (this.ended) throw new ShmError("misuse", "the file is closed");
    signal?.throwIfAborted();
    this.worker ??= this.start();
    const id = this.ids++;
    const abort = () => this.abort(id, signal.reason);
    signal?.addEventListener("abort", abort);
    try {
      return await new Promise((resolve, reject) => {
        const message = { id, name, argument, watched: progress !== undefined };
        this.calls.set(id, { message, resolve, reject, progress });
        this.post(message);
      });
    } finally {
      signal?.removeEventListener("abort", abort);
      this.calls.delete(id);
      if (this.calls.size === 0) this.running?.unref?.();
    }
  }

  /** Starts a worker. In Node.js, a worker without pending calls does not keep the program
   *  running. */
  async start() {
    let worker;
    // Do not change these expressions: bundlers search for them to find worker.js.
    if (typeof Worker === "function") {
      worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
      worker.onmessage = ({ data }) => this.take(worker, data);
      worker.onerror = ({ message }) => this.fail(worker, message ?? "it cannot be loaded");
    } else {
      const threads = await import("node:worker_threads");
      worker = new threads.Worker(new URL("./worker.js", import.meta.url));
      worker.on("message", (data) => this.take(worker, data));
      worker.on("error", (error) => this.fail(worker, error.message));
    }
    worker.postMessage({ open: this.open });
    this.running = worker;
    return worker;
  }

  async post(message) {
    try {
      const worker = await this.worker;
      worker?.ref?.();
      worker?.postMessage(message);
    } catch (cause) {
      // The worker cannot be started, for example because the page's Content-Security-Policy
      // forbids workers.
      this.worker = null;
      const error = new ShmError("io", `the worker cannot be started: ${cause.message}`, { cause });
      this.calls.get(message.id)?.reject(error);
    }
  }

  take(worker, { id, result, error, progress }) {
    const call = worker === this.running ? this.calls.get(id) : undefined;
    if (progress !== undefined) call?.progress(progress);
    else if (error !== undefined) call?.reject(unpacked(error));
    else call?.resolve(result);
  }

  /** Aborts a call. If the worker is already running it, the worker is terminated, because a
   *  decoder cannot be interrupted, and all other pending calls start again in a new worker. */
  abort(id, reason) {
    const isRunning = this.calls.keys().next().value === id;
    this.calls.get(id)?.reject(reason);
    this.calls.delete(id);
    if (!isRunning) {
      this.post({ dropped: id });
      return;
    }
    this.stop();
    if (this.calls.size === 0) return;
    this.worker = this.start();
    for (const { message } of this.calls.values()) this.post(message);
  }

  fail(worker, sentence) {
    if (worker !== this.running) return;
    this.stop();
    this.rejectAll(new ShmError("io", `the worker failed: ${sentence}`));
  }

  rejectAll(error) {
    for (const { reject } of this.calls.values()) reject(error);
    this.calls.clear();
  }

  async stop() {
    const { worker } = this;
    this.worker = this.running = null;
    try {
      await (await worker)?.terminate();
    } catch {
      // The worker was never started.
    }
  }

  async end() {
    this.ended = true;
    this.rejectAll(new ShmError("misuse", "the file was closed"));
    await this.stop();
  }
}
