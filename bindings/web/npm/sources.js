// Sources: fetch bytes of a Blob, a file or a URL when they are needed. WebAssembly cannot wait for
// a fetch. Therefore a decoder call fails if it needs bytes that have not been fetched; then the
// bytes are fetched, and the call is repeated. The library announces most ranges before it reads
// the first of them, so only a few repetitions are needed.
import { ShmError } from "./errors.js";

// Size of the first fetch in bytes. The first bytes of a file identify it as a .shm file, and
// usually contain its schema.
const FRONT = 1 << 12;
// Sizes in bytes that control fetching: FAR is for files on a server, HERE is for local files.
// - guess: number of bytes to fetch if the missing bytes were not announced. The last `guess` bytes
//   of a file usually contain the index.
// - near: ranges with a gap of at most this size between them are fetched as one range. HERE.near
//   is larger, because reading the gap in a local file costs less than another fetch, after which
//   the decoder call must be repeated.
const FAR = { guess: 1 << 14, near: 1 << 11 };
const HERE = { guess: 1 << 20, near: 1 << 16 };
// If there are more than MANY ranges to fetch, larger gaps are allowed, too: `near` (see above) is
// doubled until there are at most MANY ranges or `near` has reached NEAR_OF_MANY bytes.
const NEAR_OF_MANY = 1 << 16;
const MANY = 24;
const MOST_AT_ONCE = 6; // maximum number of simultaneous requests
const MOST_KEPT = 64 << 20; // maximum number of bytes kept from one call to the next
const MOST_WHOLE = 256 << 20; // maximum size in bytes of a file that a server sends as a whole
// Maximum number of bytes to fetch for an unannounced read. The number of bytes is `guess` for the
// first unannounced read, and doubles with each further one.
const MOST_GUESSED = 16 << 20;

/** Every .shm file begins with these bytes. */
const SIGNATURE = [0x89, 0x53, 0x48, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];

/** The bytes of a Blob. In this module, a range [first, end] does not include the byte at `end`. */

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

/** A file on a server. The first request fetches the beginning of the file and its size. A server
 *  without range requests returns the whole file instead. If the first bytes are not those of a
 *  .shm file, the file is rejected, unless `isDamaged` is true. */
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

  /** Returns the size of the file, from the header Content-Range. A server with another origin than
   *  the page may not expose this header; in this case, a HEAD request returns the size. */
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
  /** Throws an error unless the response has the status 206, i.e. contains a range of the file. */
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
  /** Returns an error for a failed connection. If the origin of the server differs from that of the
   *  page, the browser hides the reason from the script, so the message names a likely cause. */
  failed(cause) {
    const { origin } = globalThis.location ?? {};
    const isOther = origin !== undefined && origin !== new URL(this.url).origin;
    return this.error(`the connection failed: ${cause.cause?.message ?? cause.message}`
      + (isOther ? ", or the server does not allow pages of other origins to read the file (CORS)" : ""),
    { cause });
  }
  otherBytes() {
    return this.error("the server did not return the requested bytes");
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

  /** Reads the body of a response. Throws an error if the body has more than `most` bytes. Calls
   *  check() with the first bytes of the body; check() may throw. */
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

/** Returns an object that fetches the bytes of a source: a BlobBytes, FileBytes or UrlBytes. */
function opened(source, isDamaged, signal) {
  if (typeof source !== "string") return new BlobBytes(source);
  const url = new URL(source);
  return url.protocol === "file:" ? FileBytes.open(url) : UrlBytes.open(url, isDamaged, signal);
}

/** The fetched pieces of a file, in ascending order and without overlaps. At the end of each call,
 *  the oldest pieces are dropped until at most MOST_KEPT bytes remain. */
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

  /** Returns the parts of a range that have not been fetched. */
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

  /** Fills `into` with the bytes of the file from `first` on. All of them must have been
   *  fetched. */
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

/** A file from which a decoder call can read all bytes that have been fetched. Missing bytes
 *  are fetched between two calls. */
export class Source {
  /** Opens a source. If `isDamaged` is true, the signature of the file is not checked. */
  static async open(source, isDamaged, signal) {
    const file = new Source();
    file.from = await opened(source, isDamaged, signal);
    file.size = file.from.size;
    file.name = file.from.name;
    file.reach = file.from instanceof UrlBytes ? FAR : HERE;
    file.kept = new Pieces();
    if (file.from.front !== undefined) file.kept.add(0, file.from.front);
    file.told = [];
    // the first range that the previous decoder call needed but that had not been fetched
    file.missing = null;
    file.misses = 0;
    return file;
  }

  /** Announces ranges that will be read next, a list of {offset, bytes}. */
  tell(ranges) {
    for (const { offset, bytes } of ranges) this.told.push([offset, offset + bytes]);
  }

  /** Fills `into` with the bytes from `offset` on, if all of them have been fetched, and returns
   *  true. Otherwise stores their range in `missing` and returns false. */
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

  /** Fetches the missing range. If it is part of the announced ranges, fetches all announced
   *  ranges. */
  async fetchMissing(signal) {
    const [first, end] = this.missing;
    // One read may span several announced ranges, so adjacent ranges are merged first.
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
        // A merged range can contain bytes that were fetched earlier, so only the missing bytes are
        // added to the fetched pieces.
        for (const [first, end] of this.kept.gaps(from, to)) {
          this.kept.add(first, bytes.subarray(first - from, end - from));
        }
      }
    };
    const done = await Promise.allSettled(
      Array.from({ length: Math.min(MOST_AT_ONCE, runs.length) }, fetchSome));
    for (const one of done) if (one.status === "rejected") throw one.reason;
  }

  /** Returns a larger range that contains the missing range, because nearby bytes are likely to be
   *  read next. The size of the returned range doubles each time. */
  guessed(first, end) {
    const least = Math.min(MOST_GUESSED, this.reach.guess * 2 ** this.misses++);
    const to = Math.min(this.size, Math.max(end, first + least));
    return [Math.max(0, Math.min(first, to - least)), to];
  }

  /** Merges ranges if the gap between them has at most `near` bytes. Returns the merged ranges in
   *  ascending order. */
  static merged(ranges, near) {
    const runs = [];
    for (const [first, end] of [...ranges].sort((a, b) => a[0] - b[0])) {
      const last = runs.at(-1);
      if (last !== undefined && first <= last[1] + near) last[1] = Math.max(last[1], end);
      else if (first < end) runs.push([first, end]);
    }
    return runs;
  }

  /** Ends a call. Keeps the most recently fetched pieces, at most MOST_KEPT bytes, and drops all
   *  older pieces. */
  end() {
    this.begin();
    this.misses = 0;
    this.kept.shrink(MOST_KEPT);
  }

  close() {
    return this.from.close();
  }
}
