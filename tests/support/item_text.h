// Converts the contents of a .shm file to readable text. Such a text is stored next to each golden
// file. The contents of two files are equal bit for bit if their texts are equal.
#pragma once

#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "shm/archive.h"
#include "shm/reader.h"

namespace shm {

struct Decoded {
  Schema schema;
  std::vector<Item> items;
};

/// Decodes `bytes`. Passes them to the decoder in pieces of `piece` bytes, or all at once if
/// `piece` is 0.
inline Result<Decoded> decode_in_pieces(std::span<const std::byte> bytes, std::size_t piece = 0,
                                        const ReadLimits& limits = {}) {
  Decoder decoder(limits);
  Decoded decoded;
  if (piece == 0) piece = bytes.size() + 1;
  bool ended = false;
  while (true) {
    auto progress = decoder.advance();
    if (!progress) return progress.error();
    if (*progress == Decoder::Progress::item_ready) {
      decoded.items.push_back(decoder.take());
    } else if (*progress == Decoder::Progress::finished) {
      decoded.schema = *decoder.schema();
      return decoded;
    } else if (!bytes.empty()) {
      const auto part = bytes.first(std::min(piece, bytes.size()));
      if (auto status = decoder.feed(part); !status) return status.error();
      bytes = bytes.subspan(part.size());
    } else if (std::exchange(ended, true)) {
      return Error{ErrorCode::misuse, "the decoder wants more than everything", {}, kNoOffset, {}};
    } else {
      decoder.end_of_input();
    }
  }
}

class ItemText {
 public:
  static std::string of(const Decoded& decoded) {
    ItemText text(decoded.schema);
    text.add_schema();
    for (const Item& item : decoded.items) std::visit([&](const auto& it) { text.add(it); }, item);
    return std::move(text.out_);
  }

 private:
  explicit ItemText(const Schema& schema) : schema_(schema) {}

  template <class T>
  void number(T value) {
    char digits[32];
    out_.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
  }
  template <class T>
  void scalar_of(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    if constexpr (std::is_floating_point_v<T>) {
      if (std::isnan(value)) {  // writes the NaN with its payload
        out_ += "nan:";
        using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
        char digits[20];
        const auto bits = std::bit_cast<Bits>(value);
        out_.append(digits, std::to_chars(digits, digits + sizeof digits, bits, 16).ptr);
        return;
      }
      number(value);
    } else {
      number(value);
    }
  }
  void scalars(ScalarType type, std::span<const std::byte> bytes) {
    const std::size_t width = scalar_bytes(type);
    for (std::size_t at = 0; at + width <= bytes.size(); at += width) {
      out_ += ' ';
      scalar(type, bytes.data() + at);
    }
  }
  void scalar(ScalarType type, const std::byte* at) {
    switch (type) {
      case ScalarType::int8: return number(static_cast<int>(static_cast<std::int8_t>(*at)));
      case ScalarType::uint8: return number(std::to_integer<int>(*at));
      case ScalarType::int16: return scalar_of<std::int16_t>(at);
      case ScalarType::uint16: return scalar_of<std::uint16_t>(at);
      case ScalarType::int32: return scalar_of<std::int32_t>(at);
      case ScalarType::uint32: return scalar_of<std::uint32_t>(at);
      case ScalarType::int64: return scalar_of<std::int64_t>(at);
      case ScalarType::uint64: return scalar_of<std::uint64_t>(at);
      case ScalarType::float32: return scalar_of<float>(at);
      case ScalarType::float64: return scalar_of<double>(at);
    }
  }
  template <class List>
  void list(const char* name, const List& values) {
    out_ += name;
    for (const auto& value : values) {
      out_ += ' ';
      number(value);
    }
  }
  template <class T>
  void field(const char* name, T value) {
    out_ += name;
    out_ += ' ';
    number(value);
  }
  void quantization(const Quantization& q) {
    if (!q.lossy()) return;
    if (q.bits == Quantization::kRelative) {
      field(", within", q.max_rel);
      field(" of each value by", q.spacing);
      return;
    }
    if (q.bits == Quantization::kAbsolute) {
      field(", within", q.max_abs);
      field(" by steps of", q.spacing);
      list(" from", q.minimum);
      return;
    }
    field(", quantized to bits", q.bits);
    list(" from", q.minimum);
    list(" to", q.maximum);
  }

  void add_schema() {
    out_ += "order " + std::string(order_name(schema_.order));
    out_ += schema_.corner_order ? ", corners in order" : ", corners may turn";
    field(", delay", schema_.delay);
    if (schema_.step_references != StepReference::base)
      field(", step references", static_cast<int>(schema_.step_references));
    out_ += ", coordinates " + std::string(scalar_name(schema_.coordinate_type));
    quantization(schema_.coordinate_quantization);
    out_ += ", source '" + schema_.source_format + "'\n";
    for (const BlockInfo& block : schema_.blocks) {
      field("block id", block.id);
      out_ += " '" + block.name + "' " + std::string(shape_name(block.shape));
      field(", nodes", block.nodes_per_cell);
      if (block.scheme != NodeScheme::lagrange)
        out_ += ", " + std::string(scheme_name(block.scheme));
      out_ += '\n';
    }
    for (std::size_t a = 0; a < schema_.arrays.size(); ++a) {
      const ArrayInfo& info = schema_.arrays[a];
      out_ += array_stream_name(schema_, a) + ' ' + std::string(scalar_name(info.type));
      field(" x", info.components);
      out_ += info.per_step ? ", by step" : ", static";
      const bool on_mesh = is_on_mesh(info.location);
      if (!info.blocks.empty()) list(on_mesh ? ", on blocks" : ", on sets", info.blocks);
      if (!on_mesh) field(", elements", info.elements);
      if (!info.role.empty()) out_ += ", role '" + info.role + "'";
      quantization(info.quantization);
      if (!info.fills.empty()) list(", fills", info.fills);
      out_ += '\n';
    }
  }

  void add(const MeshBlock& block) {
    field("mesh: first vertex", block.first_vertex);
    field(", vertices", block.vertex_count());
    field(", first cell", block.first_cell);
    field(", cells", block.cell_count());
    out_ += '\n';
    const std::size_t width = 3 * scalar_bytes(schema_.coordinate_type);
    std::size_t vertex = 0;
    const auto vertices_below = [&](std::uint64_t end) {
      for (; vertex < end; ++vertex) {
        field("  vertex", block.vertex_numbers[vertex]);
        out_ += ':';
        scalars(schema_.coordinate_type, std::span(block.xyz).subspan(vertex * width, width));
        out_ += '\n';
      }
    };
    auto other = block.other_last_uses.begin();
    for (std::size_t c = 0; c < block.cell_count(); ++c) {
      vertices_below(block.vertices_before_cell[c]);
      field("  cell", block.cell_numbers[c]);
      field(" of block", block.cell_blocks[c]);
      const auto begin = static_cast<std::size_t>(block.corner_begin[c]);
      const auto end = static_cast<std::size_t>(block.corner_begin[c + 1]);
      list(":", std::span(block.corners).subspan(begin, end - begin));
      field(", last use", block.last_use[c]);
      for (; other != block.other_last_uses.end() && other->cell == c; ++other)
        field(" and of", other->vertex);
      out_ += '\n';
    }
    vertices_below(block.vertex_count());
    for (std::size_t a = 0; a < block.arrays.size(); ++a) {
      if (block.arrays[a].empty()) continue;
      out_ += "  " + array_stream_name(schema_, a) + ":";
      scalars(schema_.arrays[a].type, block.arrays[a]);
      out_ += '\n';
    }
  }
  void add(const StepPiece& piece) {
    field("step", piece.step);
    field(" from element", piece.first);
    out_ += ", " + array_stream_name(schema_, piece.array) + ":";
    scalars(schema_.arrays[piece.array].type, piece.values);
    out_ += '\n';
  }
  void add(const StepTimes& times) {
    list("step times:", times.times);
    out_ += '\n';
  }
  void add(const Extra& extra) {
    out_ += "extra '" + extra.key + "' " + std::string(scalar_name(extra.type));
    list(" shape", extra.shape);
    field(", refers", static_cast<int>(extra.refers));
    out_ += ':';
    scalars(extra.type, extra.data);
    out_ += '\n';
  }
  /// Adds the totals of the file to the text. Sizes in bytes are omitted, because they are not part
  /// of the contents.
  void add(const Totals& totals) {
    field("totals: vertices", totals.vertices);
    field(", cells", totals.cells);
    field(", hexahedra", totals.hexahedra);
    field(", most active vertices", totals.max_active_vertices);
    field(", steps", totals.steps);
    list(", cells by block", totals.block_cells);
    field(", trailing bytes", totals.trailing_bytes);
    out_ += '\n';
  }

  const Schema& schema_;
  std::string out_;
};

/// Returns the contents of a whole file as text. For an archive, returns the text of each member
/// under its name.
inline Result<std::string> text_of_file(std::span<const std::byte> bytes) {
  if (!looks_like_archive(bytes)) {
    const auto decoded = decode_in_pieces(bytes);
    if (!decoded) return decoded.error();
    return ItemText::of(*decoded);
  }
  MemoryRandomSource source(bytes);
  const auto archive = ArchiveReader::open(source);
  if (!archive) return archive.error();
  std::string text;
  for (const ArchiveMember& member : archive->members()) {
    const auto decoded = decode_in_pieces(bytes.subspan(static_cast<std::size_t>(member.offset),
                                                        static_cast<std::size_t>(member.bytes)));
    if (!decoded) return decoded.error();
    text += "member " + member.name + "\n" + ItemText::of(*decoded);
  }
  return text;
}

}  // namespace shm
