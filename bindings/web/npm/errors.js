/** Why a call failed. `message` is a sentence for people, the library's own where it has one. */
export class ShmError extends Error {
  /**
   * @param {string} status "io", "truncated", "corrupt", "unsupported", "over limit", "misuse",
   *   "no memory", "cancelled"
   * @param {string} message
   * @param {{section?: string, detail?: string, offset?: number | null, cause?: unknown}} [more]
   */
  constructor(status, message, more = {}) {
    super(message, more.cause === undefined ? undefined : { cause: more.cause });
    this.name = "ShmError";
    this.status = status;
    this.section = more.section ?? "";
    this.detail = more.detail ?? message;
    this.offset = more.offset ?? null;
  }
}

/** An error as a message between threads can carry it, and back. */
export function packed(error) {
  if (!(error instanceof ShmError)) {
    return { name: error?.name ?? "Error", message: String(error?.message ?? error) };
  }
  const { name, status, message, section, detail, offset } = error;
  return { name, status, message, section, detail, offset };
}
export function unpacked(told) {
  if (told.name === "ShmError") return new ShmError(told.status, told.message, told);
  const kinds = { TypeError, RangeError };
  const error = new (kinds[told.name] ?? Error)(told.message);
  error.name = told.name;
  return error;
}
