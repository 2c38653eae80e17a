// Layout of the structs of shmformat.h in WebAssembly memory. size_t and pointers have 32 bits
// there, and every member is aligned to its size. web_test.py compares this layout with the header.

const SIZES = { i32: 4, u32: 4, i64: 8, u64: 8, f64: 8, pointer: 4, char: 1 };

/** Computes the layout of a struct: offset of each member, and size of the struct. A member is
 *  given as "type name", an array as "type[count] name". */
function layout(...members) {
  const fields = {};
  let end = 0;
  let widest = 1;
  for (const member of members) {
    const [type, name] = member.split(" ");
    const [, scalar, count] = /^(\w+)(?:\[(\d+)\])?$/.exec(type);
    const size = SIZES[scalar];
    const offset = Math.ceil(end / size) * size;
    fields[name] = { type: scalar, offset, count: count === undefined ? 0 : Number(count) };
    end = offset + size * Number(count ?? 1);
    widest = Math.max(widest, size);
  }
  return { fields, bytes: Math.ceil(end / widest) * widest };
}

export const LAYOUTS = {
  shmf_error: layout("i32 status", "i32 reserved", "u64 offset", "char[120] section",
    "char[360] detail", "char[528] message"),
  shmf_open_options: layout("u32 struct_size", "i32 damaged", "u32 max_arrays",
    "u32 max_static_components", "u32 max_blocks", "u32 max_segments", "u64 max_active_vertices",
    "u64 max_chunk_bytes", "u64 max_group_bytes", "u64 max_extra_bytes", "u64 max_steps",
    "u64 max_unpacked_bytes", "u64 max_column_bytes", "u64 max_vertices", "u64 max_cells",
    "u64 max_decoded_bytes", "u64 max_active_bytes"),
  shmf_range: layout("u64 offset", "u64 bytes"),
  shmf_source: layout("u32 struct_size", "pointer context", "u64 bytes", "pointer read_at",
    "pointer close", "pointer prefetch"),
  shmf_info: layout("u32 struct_size", "u64 vertices", "u64 cells", "u64 hexahedra", "u64 steps",
    "u64 file_bytes", "u32 blocks", "u32 arrays", "u32 segments", "i32 coordinate_type",
    "i32 order", "i32 has_digest", "pointer source_format", "f64 coordinate_error", "u64 digest"),
  shmf_block: layout("u32 struct_size", "i64 id", "pointer name", "i32 shape",
    "u32 nodes_per_cell", "u64 cells", "i32 node_scheme", "i32 reserved"),
  shmf_array: layout("u32 struct_size", "pointer name", "pointer role", "i32 location",
    "i32 type", "u32 components", "i32 per_step", "u64 elements", "pointer blocks",
    "u32 block_count", "u32 fill_count", "f64 error", "f64 relative_error", "pointer fills"),
  shmf_segment: layout("u32 struct_size", "u64 first_cell", "u64 cells", "u64 first_vertex",
    "u64 vertices", "u64 bytes", "f64[6] box"),
  shmf_extra: layout("u32 struct_size", "pointer key", "i32 type", "i32 refers", "pointer shape",
    "pointer data", "u64 bytes", "u32 dimensions", "u32 reserved"),
  shmf_set: layout("u32 struct_size", "i32 kind", "u32 block_count", "i64 id", "pointer name",
    "u64 members", "pointer numbers", "pointer sides", "pointer blocks", "u64 factor_count",
    "pointer factors"),
  shmf_run_options: layout("u32 struct_size", "pointer progress", "pointer context",
    "u32 threads", "u32 reserved"),
  shmf_selection: layout("u32 struct_size", "u64 first_cell", "u64 end_cell", "pointer blocks",
    "u32 block_count", "i32 has_box", "f64[6] box", "pointer numbers", "u64 number_count"),
  shmf_counts: layout("u32 struct_size", "u64 vertices", "u64 cells", "u64 corners"),
  shmf_target: layout("u32 struct_size", "i32 what", "i32 type", "u32 array", "u32 flags",
    "u64 step", "pointer data", "u64 bytes", "u64 used"),
  shmf_boundary_options: layout("u32 struct_size", "pointer arrays", "pointer steps",
    "u32 array_count", "u64 max_bytes", "u32 subdivide", "u32 reserved"),
  shmf_surface: layout("u32 struct_size", "u64 vertices", "u64 faces", "u64 corners",
    "u64 left_out", "pointer vertex_numbers", "pointer xyz", "pointer face_begin",
    "pointer face_corners", "pointer cell_numbers", "pointer cell_blocks", "pointer sides",
    "pointer array_values", "pointer array_bytes", "i32 coordinate_type", "i32 reserved"),
};

/** Converts a 64-bit integer to a Number. Throws RangeError if it exceeds 2^53. */
export function toNumber(big) {
  if (big > BigInt(Number.MAX_SAFE_INTEGER)) throw new RangeError(`${big} is more than 2^53`);
  return Number(big);
}

/** Returns the members of the struct at `address`. A 64-bit integer becomes a BigInt, an array
 *  becomes an Array. */
export function readStruct(view, name, address) {
  const read = (type, place) => {
    switch (type) {
      case "i32": return view.getInt32(place, true);
      case "i64": return view.getBigInt64(place, true);
      case "u64": return view.getBigUint64(place, true);
      case "f64": return view.getFloat64(place, true);
      case "char": return view.getUint8(place);
      default: return view.getUint32(place, true);
    }
  };
  const struct = {};
  for (const [member, { type, offset, count }] of Object.entries(LAYOUTS[name].fields)) {
    if (count === 0) {
      struct[member] = read(type, address + offset);
    } else {
      struct[member] = Array.from({ length: count },
        (_, i) => read(type, address + offset + i * SIZES[type]));
    }
  }
  return struct;
}

/** Writes a struct at `address`. Sets struct_size to the size of the struct, sets the members in
 *  `values`, and sets all other members to 0. */
export function writeStruct(view, name, address, values = {}) {
  const { fields, bytes } = LAYOUTS[name];
  for (let i = 0; i < bytes; ++i) view.setUint8(address + i, 0);
  const write = (type, place, value) => {
    switch (type) {
      case "i32": return view.setInt32(place, value, true);
      case "i64": return view.setBigInt64(place, BigInt(value), true);
      case "u64": return view.setBigUint64(place, BigInt(value), true);
      case "f64": return view.setFloat64(place, value, true);
      case "char": return view.setUint8(place, value);
      default: return view.setUint32(place, value, true);
    }
  };
  if (fields.struct_size !== undefined) view.setUint32(address, bytes, true);
  for (const [member, value] of Object.entries(values)) {
    const { type, offset, count } = fields[member];
    if (count === 0) write(type, address + offset, value);
    else value.forEach((one, i) => write(type, address + offset + i * SIZES[type], one));
  }
}
