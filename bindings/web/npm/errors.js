/** The failure of a call. `message` is a human-readable sentence. If the library reported the
 *  failure, `message` is the message of the library. */
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

/** Converts an error to an object that can be sent to another thread. unpacked() converts it
 *  back. */
export function packed(error) {
  if (!(error instanceof ShmError)) {
    return { name: error?.name ?? "Error", message: String(error?.message ?? error) };
  }
  const { name, status, message, section, detail, offset } = error;
  return { name, status, message, section, detail, offset };
}
export function unpacked(data) {
  if (data.name === "ShmError") return new ShmError(data.status, data.message, data);
  const kinds = { TypeError, RangeError };
  const error = new (kinds[data.name] ?? Error)(data.message);
  error.name = data.name;
  return error;
}
