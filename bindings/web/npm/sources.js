// Bytes that are somewhere else: parts of a Blob, ranges of a URL. WebAssembly cannot wait for them.
// So what is not here yet makes the decoder's call fail, is fetched, and the call is made again; the
// library tells most ranges before it reads the first of them, so that this happens a few times.
import { ShmError } from "./errors.js";

const FRONT = 1 << 12; // bytes that are fetched first: what the file is, and its schema as a rule
// guess: bytes that are fetched with one that nobody told of, of a server's file the index as a
// rule; near: ranges that are not so far apart are fetched as one. What is here costs little, and
// each fetch a call that is made again.
const FAR = { guess: 1 << 14, near: 1 << 11 };
const HERE = { guess: 1 << 20, near: 1 << 16 };
const NEAR_OF_MANY = 1 << 16; // near, where there would be many ranges
const MANY = 24;
const MOST_AT_ONCE = 6; // requests
const MOST_KEPT = 64 << 20; // bytes that stay from one call to the next
const MOST_WHOLE = 256 << 20; // bytes of a file on a server that gives no ranges
const MOST_GUESSED = 16 << 20; // bytes that are fetched at once though nobody told of them

/** What every .shm file begins with. */
const SIGNATURE = [0x89, 0x53, 0x48, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];

/** A range of bytes: [first, behind the last]. */

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

/** A file on the disk of the machine that runs Node.js. */
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
    for (let at = 0; at < bytes.length;) {
      const { bytesRead } = await this.handle.read(bytes, at, bytes.length - at, first + at);
      if (bytesRead === 0) throw new ShmError("io", `${this.name}: is shorter than it was`);
      at += bytesRead;
    }
    signal?.throwIfAborted();
    return bytes;
  }

  close() {
    return this.handle.close();
  }
}

/** A file on a server. The first request fetches its front, and tells its size; where there are no
 *  ranges it fetches all. A file of another kind is refused by its front, unless `isDamaged`. */
class UrlBytes {
  static async open(url, isDamaged, signal) {
    const file = new UrlBytes();
    file.url = file.name = url.href;
    const check = (first) => {
      if (!isDamaged && SIGNATURE.some((byte, i) => i < first.length && byte !== first[i])) {
        throw file.error("this is no .shm file", { status: "corrupt" });
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

  /** Of several origins a server may not let pages see Content-Range: then HEAD tells. */
  async total(answer, signal) {
    const told = /^bytes (\d+)-(\d+)\/(\d+)$/.exec(answer.headers.get("Content-Range") ?? "");
    if (told !== null) {
      if (Number(told[1]) !== 0 || Number(told[2]) + 1 !== this.front.length) {
        throw this.otherBytes();
      }
      return Number(told[3]);
    }
    if (answer.headers.has("Content-Range")) throw this.otherBytes();
    if (this.front.length < FRONT) return this.front.length;
    const head = await this.ask({ method: "HEAD" }, signal);
    const size = head.headers.get("Content-Length");
    if (!head.ok || size === null || !/^\d+$/.test(size)) {
      throw this.error("the server does not say how long the file is");
    }
    return Number(size);
  }

  error(sentence, { status = "io", cause } = {}) {
    return new ShmError(status, `${this.name}: ${sentence}`, { detail: sentence, cause });
  }
  /** Throws unless an answer has a range in it. */
  async expect(answer) {
    const { status } = answer;
    if (status === 206) return;
    await answer.body?.cancel();
    if (status === 404 || status === 410) {
      throw this.error(`there is no such file: the server answers ${status}`);
    }
    if (status === 401 || status === 403) {
      throw this.error(`the server refuses to give it: it answers ${status}`);
    }
    throw this.error(`the server answers ${status}`);
  }
  /** Browsers tell a page no more of a server of another origin. */
  failed(cause) {
    const { origin } = globalThis.location ?? {};
    const isOther = origin !== undefined && origin !== new URL(this.url).origin;
    return this.error(`the connection failed: ${cause.cause?.message ?? cause.message}`
      + (isOther ? ", or the server lets no page of another origin have the file (CORS)" : ""),
    { cause });
  }
  otherBytes() {
    return this.error("the server gives other bytes than it was asked for");
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

  /** Of a body that is longer than `most` no more is read; nor where check(its first bytes)
   *  throws. */
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
            `the server gives no ranges of files, and this one has more than ${most} bytes`);
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
    let at = 0;
    for (const piece of pieces) {
      bytes.set(piece, at);
      at += piece.length;
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
      throw this.error("the server gives no ranges of files any more");
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

/** What a source is, as the bytes that can be fetched of it. */
function opened(source, isDamaged, signal) {
  if (typeof source !== "string") return new BlobBytes(source);
  const url = new URL(source);
  return url.protocol === "file:" ? FileBytes.open(url) : UrlBytes.open(url, isDamaged, signal);
}

/** Pieces of bytes by their place, ascending and apart; the oldest are dropped first. */
class Pieces {
  constructor() {
    this.pieces = []; // {first, end, bytes, age}
    this.bytes = 0;
    this.age = 0;
  }

  /** The first piece that ends behind `at`. */
  find(at) {
    let low = 0;
    let high = this.pieces.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.pieces[middle].end > at) high = middle;
      else low = middle + 1;
    }
    return low;
  }

  /** What of a range is not here. */
  gaps(first, end) {
    const gaps = [];
    let at = first;
    for (let i = this.find(first); i < this.pieces.length && this.pieces[i].first < end; ++i) {
      if (this.pieces[i].first > at) gaps.push([at, this.pieces[i].first]);
      at = this.pieces[i].end;
    }
    if (at < end) gaps.push([at, end]);
    return gaps;
  }

  add(first, bytes) {
    this.pieces.splice(this.find(first), 0,
      { first, end: first + bytes.length, bytes, age: this.age++ });
    this.bytes += bytes.length;
  }

  /** Fills `into` with bytes that are all here. */
  copy(first, into) {
    let at = first;
    for (let i = this.find(first); at < first + into.length; ++i) {
      const piece = this.pieces[i];
      const end = Math.min(piece.end, first + into.length);
      into.set(piece.bytes.subarray(at - piece.first, end - piece.first), at - first);
      at = end;
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

/** A file whose bytes are read where they are here, and fetched between calls where they are not. */
export class Source {
  /** `isDamaged`: what may be a .shm file is taken as one. */
  static async open(source, isDamaged, signal) {
    const it = new Source();
    it.from = await opened(source, isDamaged, signal);
    it.size = it.from.size;
    it.name = it.from.name;
    it.reach = it.from instanceof UrlBytes ? FAR : HERE;
    it.kept = new Pieces();
    if (it.from.front !== undefined) it.kept.add(0, it.from.front);
    it.told = [];
    it.missing = null; // the range that the last call wanted and did not get
    it.misses = 0;
    return it;
  }

  /** What will be read next: [{offset, bytes}]. */
  tell(ranges) {
    for (const { offset, bytes } of ranges) this.told.push([offset, offset + bytes]);
  }

  /** Fills `into`, or remembers what is missing; whether it was filled. */
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

  /** Fetches what was missing, with what it will be read with. */
  async fetchMissing(signal) {
    const [first, end] = this.missing;
    // What is read at once may have been told of in parts.
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
        // Between gaps there may be what is here already.
        for (const [first, end] of this.kept.gaps(from, to)) {
          this.kept.add(first, bytes.subarray(first - from, end - from));
        }
      }
    };
    const done = await Promise.allSettled(
      Array.from({ length: Math.min(MOST_AT_ONCE, runs.length) }, fetchSome));
    for (const one of done) if (one.status === "rejected") throw one.reason;
  }

  /** More than was asked for, and the more the oftener: what is beside will be read, too. */
  guessed(first, end) {
    const least = Math.min(MOST_GUESSED, this.reach.guess * 2 ** this.misses++);
    const to = Math.min(this.size, Math.max(end, first + least));
    return [Math.max(0, Math.min(first, to - least)), to];
  }

  /** Those of a list that are closer than `near` as one, ascending. */
  static merged(ranges, near) {
    const runs = [];
    for (const [first, end] of [...ranges].sort((a, b) => a[0] - b[0])) {
      const last = runs.at(-1);
      if (last !== undefined && first <= last[1] + near) last[1] = Math.max(last[1], end);
      else if (first < end) runs.push([first, end]);
    }
    return runs;
  }

  /** After a call: most of what was fetched may go. */
  end() {
    this.begin();
    this.misses = 0;
    this.kept.shrink(MOST_KEPT);
  }

  close() {
    return this.from.close();
  }
}
