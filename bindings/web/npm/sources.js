// Sources: bytes of a Blob, a file or a URL, fetched on demand. WebAssembly cannot wait for a
// fetch. Therefore a decoder call that needs missing bytes fails; the bytes are fetched, and the
// call is repeated. The library announces most ranges before it reads the first of them, so only a
// few repetitions are needed.
import { ShmError } from "./errors.js";

// The first fetch has this size in bytes. These bytes identify the file, and usually contain its
// schema.
const FRONT = 1 << 12;
// FAR applies to files on a server, HERE to local files.
// - guess: number of bytes fetched around a missing byte that was not announced. At the end of a
//   file, they usually contain the index.
// - near: ranges closer than this number of bytes are fetched as one range. Local bytes are cheap,
//   but each fetch repeats a call.
const FAR = { guess: 1 << 14, near: 1 << 11 };
const HERE = { guess: 1 << 20, near: 1 << 16 };
// maximum of `near` in bytes; `near` grows if there are more than MANY ranges
const NEAR_OF_MANY = 1 << 16;
const MANY = 24;
const MOST_AT_ONCE = 6; // maximum number of concurrent requests
const MOST_KEPT = 64 << 20; // maximum bytes kept from one call to the next
const MOST_WHOLE = 256 << 20; // largest file that is fetched from a server without range requests
const MOST_GUESSED = 16 << 20; // largest guess

/** Every .shm file begins with these bytes. */
const SIGNATURE = [0x89, 0x53, 0x48, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];

/** The bytes of a Blob. A range [first, end] in this file does not include the byte at `end`. */

class BlobBytes {
  constructor(blob) {
    this.blob = blob;
    this.size = blob.size;
    this.name = blob.name ?? "";
  }

  async fetch([first, end], signal) {
    let bytes;
    try {
      bytes = new Uint8Array(await this.blob.slice(first, end).arrayBuffer());
    } catch (cause) {
      throw new ShmError("io", `the Blob cannot be read: ${cause.message}`, { cause });
    }
    signal?.throwIfAborted();
    if (bytes.length !== end - first) throw new ShmError("io", "the Blob is shorter than it was");
    return bytes;
  }

  async close() {}
}

/** A file on disk, in Node.js. */
class FileBytes {
  static async open(url) {
    const { open } = await import("node:fs/promises");
    const file = new FileBytes();
    file.name = decodeURIComponent(url.pathname);
    try {
      file.handle = await open(url);
      file.size = (await file.handle.stat()).size;
    } catch (cause) {
      throw new ShmError("io", `${file.name}: cannot be opened: ${cause.message}`, { cause });
    }
    return file;
  }

  async fetch([first, end], signal) {
    const bytes = new Uint8Array(end - first);
    for (let done = 0; done < bytes.length;) {
      const { bytesRead } = await this.handle.read(bytes, done, bytes.length - done, first + done);
      if (bytesRead === 0) throw new ShmError("io", `${this.name}: is shorter than it was`);
      done += bytesRead;
    }
    signal?.throwIfAborted();
    return bytes;
  }

  close() {
    return this.handle.close();
  }
}

/** A file on a server. The first request fetches the beginning of the file and learns its size. A
 *  server without range requests returns the whole file. Unless `isDamaged`, a file whose first
 *  bytes are not those of a .shm file is rejected. */
class UrlBytes {
  static async open(url, isDamaged, signal) {
    const file = new UrlBytes();
    file.url = file.name = url.href;
    const check = (first) => {
      if (!isDamaged && SIGNATURE.some((byte, i) => i < first.length && byte !== first[i])) {
        throw file.error("this is not a .shm file", { status: "corrupt" });
      }
    };
    const answer = await file.request([0, FRONT], signal);
    if (answer.status === 416) throw file.error("the file is empty");
    if (answer.status === 200) {
      file.whole = await file.body(answer, MOST_WHOLE, signal, check);
      file.size = file.whole.length;
      return file;
    }
    await file.expect(answer);
    file.front = await file.body(answer, FRONT, signal, check);
    file.version = UrlBytes.versionOf(answer);
    file.size = await file.total(answer, signal);
    if (file.front.length !== Math.min(FRONT, file.size)) throw file.otherBytes();
    return file;
  }

  /** Returns the size of the file. If the server of another origin hides Content-Range, a HEAD
   *  request finds the size. */
  async total(answer, signal) {
    const range = /^bytes (\d+)-(\d+)\/(\d+)$/.exec(answer.headers.get("Content-Range") ?? "");
    if (range !== null) {
      if (Number(range[1]) !== 0 || Number(range[2]) + 1 !== this.front.length) {
        throw this.otherBytes();
      }
      return Number(range[3]);
    }
    if (answer.headers.has("Content-Range")) throw this.otherBytes();
    if (this.front.length < FRONT) return this.front.length;
    const head = await this.ask({ method: "HEAD" }, signal);
    const size = head.headers.get("Content-Length");
    if (!head.ok || size === null || !/^\d+$/.test(size)) {
      throw this.error("the server does not report the size of the file");
    }
    return Number(size);
  }

  error(sentence, { status = "io", cause } = {}) {
    return new ShmError(status, `${this.name}: ${sentence}`, { detail: sentence, cause });
  }
  /** Throws an error unless the response contains the requested range (status 206). */
  async expect(answer) {
    const { status } = answer;
    if (status === 206) return;
    await answer.body?.cancel();
    if (status === 404 || status === 410) {
      throw this.error(`there is no such file: the server answers ${status}`);
    }
    if (status === 401 || status === 403) {
      throw this.error(`the server refuses access: it answers ${status}`);
    }
    throw this.error(`the server answers ${status}`);
  }
  /** Returns an error for a failed connection. For servers of other origins, browsers do not tell
   *  the page why the connection failed. */
  failed(cause) {
    const { origin } = globalThis.location ?? {};
    const isOther = origin !== undefined && origin !== new URL(this.url).origin;
    return this.error(`the connection failed: ${cause.cause?.message ?? cause.message}`
      + (isOther ? ", or the server does not allow pages of other origins to read the file (CORS)" : ""),
    { cause });
  }
  otherBytes() {
    return this.error("the server returned other bytes than requested");
  }
  static versionOf(answer) {
    return answer.headers.get("ETag") ?? answer.headers.get("Last-Modified");
  }

  async ask(how, signal) {
    try {
      return await fetch(this.url, { ...how, signal });
    } catch (cause) {
      signal?.throwIfAborted();
      throw this.failed(cause);
    }
  }
  request([first, end], signal) {
    return this.ask({ headers: { Range: `bytes=${first}-${end - 1}` } }, signal);
  }

  /** Reads the body of a response. Throws an error if the body has more than `most` bytes, or if
   *  check(first bytes of the body) throws. */
  async body(answer, most, signal, check) {
    const pieces = [];
    let length = 0;
    const reader = answer.body?.getReader();
    try {
      for (let piece; reader && !(piece = await reader.read()).done;) {
        if (length === 0) check?.(piece.value);
        length += piece.value.length;
        if (length > most) {
          throw answer.status === 206 ? this.otherBytes() : this.error(
            `the server does not support byte ranges, and this file has more than ${most} bytes`);
        }
        pieces.push(piece.value);
      }
    } catch (cause) {
      signal?.throwIfAborted();
      if (cause instanceof ShmError) {
        await reader.cancel();
        throw cause;
      }
      throw this.failed(cause);
    }
    const bytes = new Uint8Array(length);
    let position = 0;
    for (const piece of pieces) {
      bytes.set(piece, position);
      position += piece.length;
    }
    return bytes;
  }

  async fetch([first, end], signal) {
    if (this.whole) return this.whole.subarray(first, end);
    const answer = await this.request([first, end], signal);
    const version = UrlBytes.versionOf(answer);
    if ([206, 412, 416].includes(answer.status) && version !== null && version !== this.version) {
      await answer.body?.cancel();
      throw this.error("the file on the server has changed");
    }
    if (answer.status === 200) {
      await answer.body?.cancel();
      throw this.error("the server no longer supports byte ranges");
    }
    await this.expect(answer);
    const range = answer.headers.get("Content-Range");
    const bytes = await this.body(answer, end - first, signal);
    if ((range !== null && range !== `bytes ${first}-${end - 1}/${this.size}`)
        || bytes.length !== end - first) {
      throw this.otherBytes();
    }
    return bytes;
  }

  async close() {}
}

/** Returns an object that fetches the bytes of a source. */
function opened(source, isDamaged, signal) {
  if (typeof source !== "string") return new BlobBytes(source);
  const url = new URL(source);
  return url.protocol === "file:" ? FileBytes.open(url) : UrlBytes.open(url, isDamaged, signal);
}

/** Fetched pieces in ascending order, without overlaps. The oldest pieces are dropped first. */
class Pieces {
  constructor() {
    this.pieces = []; // {first, end, bytes, age}
    this.bytes = 0;
    this.age = 0;
  }

  /** Returns the index of the first piece that ends after `position`. */
  find(position) {
    let low = 0;
    let high = this.pieces.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.pieces[middle].end > position) high = middle;
      else low = middle + 1;
    }
    return low;
  }

  /** Returns the missing parts of a range. */
  gaps(first, end) {
    const gaps = [];
    let position = first;
    for (let i = this.find(first); i < this.pieces.length && this.pieces[i].first < end; ++i) {
      if (this.pieces[i].first > position) gaps.push([position, this.pieces[i].first]);
      position = this.pieces[i].end;
    }
    if (position < end) gaps.push([position, end]);
    return gaps;
  }

  add(first, bytes) {
    this.pieces.splice(this.find(first), 0,
      { first, end: first + bytes.length, bytes, age: this.age++ });
    this.bytes += bytes.length;
  }

  /** Fills `into` with the bytes from `first` on, all of which must have been fetched. */
  copy(first, into) {
    let position = first;
    for (let i = this.find(first); position < first + into.length; ++i) {
      const piece = this.pieces[i];
      const end = Math.min(piece.end, first + into.length);
      into.set(piece.bytes.subarray(position - piece.first, end - piece.first), position - first);
      position = end;
    }
  }

  shrink(most) {
    if (this.bytes <= most) return;
    for (const piece of [...this.pieces].sort((a, b) => a.age - b.age)) {
      if (this.bytes <= most) break;
      this.pieces.splice(this.pieces.indexOf(piece), 1);
      this.bytes -= piece.bytes.length;
    }
  }
}

/** A file whose fetched bytes can be read, and whose missing bytes are fetched between calls. */
export class Source {
  /** Opens a source. If `isDamaged`, the signature of the file is not checked. */
  static async open(source, isDamaged, signal) {
    const file = new Source();
    file.from = await opened(source, isDamaged, signal);
    file.size = file.from.size;
    file.name = file.from.name;
    file.reach = file.from instanceof UrlBytes ? FAR : HERE;
    file.kept = new Pieces();
    if (file.from.front !== undefined) file.kept.add(0, file.from.front);
    file.told = [];
    file.missing = null; // the first range that the last call needed and that was not fetched
    file.misses = 0;
    return file;
  }

  /** Announces ranges that will be read next: [{offset, bytes}]. */
  tell(ranges) {
    for (const { offset, bytes } of ranges) this.told.push([offset, offset + bytes]);
  }

  /** Fills `into` and returns true if all its bytes have been fetched. Otherwise stores the missing
   *  range in `missing` and returns false. */
  read(offset, into) {
    if (this.kept.gaps(offset, offset + into.length).length > 0) {
      this.missing ??= [offset, offset + into.length];
      return false;
    }
    this.kept.copy(offset, into);
    return true;
  }

  begin() {
    this.told = [];
    this.missing = null;
  }

  /** Fetches the missing range. If the announced ranges contain it, fetches all of them. */
  async fetchMissing(signal) {
    const [first, end] = this.missing;
    // One read may cover several announced ranges.
    const isTold = Source.merged(this.told, 0).some(([from, to]) => from <= first && end <= to);
    const wanted = isTold ? this.told : [this.guessed(first, end)];
    const gaps = wanted.flatMap(([from, to]) => this.kept.gaps(from, to));
    let { near } = this.reach;
    let runs = Source.merged(gaps, near);
    while (runs.length > MANY && near < NEAR_OF_MANY) runs = Source.merged(gaps, near *= 2);
    const next = runs.values();
    const fetchSome = async () => {
      for (const [from, to] of next) {
        const bytes = await this.from.fetch([from, to], signal);
        // Skips bytes between the gaps of this run that were fetched earlier.
        for (const [first, end] of this.kept.gaps(from, to)) {
          this.kept.add(first, bytes.subarray(first - from, end - from));
        }
      }
    };
    const done = await Promise.allSettled(
      Array.from({ length: Math.min(MOST_AT_ONCE, runs.length) }, fetchSome));
    for (const one of done) if (one.status === "rejected") throw one.reason;
  }

  /** Returns a range around the missing range, since nearby bytes are likely to be read next. The
   *  size of the range doubles with each miss. */
  guessed(first, end) {
    const least = Math.min(MOST_GUESSED, this.reach.guess * 2 ** this.misses++);
    const to = Math.min(this.size, Math.max(end, first + least));
    return [Math.max(0, Math.min(first, to - least)), to];
  }

  /** Merges ranges that are closer than `near` bytes. Returns the result in ascending order. */
  static merged(ranges, near) {
    const runs = [];
    for (const [first, end] of [...ranges].sort((a, b) => a[0] - b[0])) {
      const last = runs.at(-1);
      if (last !== undefined && first <= last[1] + near) last[1] = Math.max(last[1], end);
      else if (first < end) runs.push([first, end]);
    }
    return runs;
  }

  /** Ends a call: keeps the most recently fetched MOST_KEPT bytes, and drops all others. */
  end() {
    this.begin();
    this.misses = 0;
    this.kept.shrink(MOST_KEPT);
  }

  close() {
    return this.from.close();
  }
}
