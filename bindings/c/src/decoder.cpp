// Implements the decoder of a stream (shmf_decoder): the caller passes bytes and receives items.
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "errors.h"
#include "file.h"
#include "shm/reader.h"
#include "structs.h"

struct shmf_decoder {
  explicit shmf_decoder(const shm::ReadLimits& limits) : decoder(limits) {}

  shm::Decoder decoder;
  std::optional<shm::Item> item;  // the most recently returned item; its memory must stay valid
  // For each array of `item`: pointer to its values, and size of these values in bytes.
  std::vector<const void*> values;
  std::vector<std::uint64_t> bytes;
  shmf_extra extra{};
};

namespace shmf {
namespace {

using shm::Result;

void fill(shmf_item& item, const shm::MeshBlock& block, shmf_decoder& decoder) {
  item.kind = SHMF_MESH;
  item.vertices = block.vertex_count();
  item.cells = block.cell_count();
  item.first_vertex = block.first_vertex;
  item.first_cell = block.first_cell;
  item.vertex_numbers = block.vertex_numbers.data();
  item.cell_numbers = block.cell_numbers.data();
  item.xyz = block.xyz.data();
  item.cell_blocks = block.cell_blocks.data();
  item.corner_begin = block.corner_begin.data();
  item.corners = block.corners.data();
  item.last_use = block.last_use.data();
  item.vertices_before_cell = block.vertices_before_cell.data();
  decoder.values.clear();
  decoder.bytes.clear();
  for (const auto& values : block.arrays) {
    decoder.values.push_back(values.empty() ? nullptr : values.data());
    decoder.bytes.push_back(values.size());
  }
  item.array_values = decoder.values.data();
  item.array_bytes = decoder.bytes.data();
}

void fill(shmf_item& item, const shm::StepPiece& piece, shmf_decoder&) {
  item.kind = SHMF_STEP;
  item.array = piece.array;
  item.step = piece.step;
  item.first_element = piece.first;
  item.values = piece.values.data();
  item.values_bytes = piece.values.size();
}

void fill(shmf_item& item, const shm::StepTimes& times, shmf_decoder&) {
  item.kind = SHMF_TIMES;
  item.step = times.first;
  item.times = times.times.data();
  item.time_count = times.times.size();
}

void fill(shmf_item& item, const shm::Extra& extra, shmf_decoder& decoder) {
  item.kind = SHMF_EXTRA;
  decoder.extra = extra_of(extra);
  decoder.extra.struct_size = sizeof decoder.extra;
  item.extra = &decoder.extra;
}

/// Skips totals (the counts of the whole mesh), because shmf_item_kind has no kind for them.
void fill(shmf_item& item, const shm::Totals&, shmf_decoder&) { item.kind = SHMF_NEED_INPUT; }

/// Returns the next item of a kind in shmf_item_kind; items of other kinds are skipped.
Result<shmf_item> next_item(shmf_decoder& decoder) {
  while (true) {
    shmf_item item{};
    decoder.item.reset();
    const auto progress = decoder.decoder.advance();
    if (!progress) return progress.error();
    if (*progress == shm::Decoder::Progress::need_input) return item;
    if (*progress == shm::Decoder::Progress::finished) {
      item.kind = SHMF_END;
      return item;
    }
    decoder.item.emplace(decoder.decoder.take());
    std::visit([&](const auto& content) { fill(item, content, decoder); }, *decoder.item);
    if (!std::holds_alternative<shm::Totals>(*decoder.item)) return item;
  }
}

/// Like guarded(), runs `call(schema)` and stores errors in *error. Fails if the schema of the
/// stream has not been decoded yet.
template <class Call>
shmf_status with_schema(const shmf_decoder* decoder, shmf_error* error, Call&& call) noexcept {
  return guarded(error, [&]() -> Result<void> {
    if (decoder == nullptr) return misuse("the decoder is NULL");
    const shm::Schema* schema = decoder->decoder.schema();
    if (schema == nullptr) return misuse("the schema of the stream has not been decoded yet");
    return call(*schema);
  });
}

}  // namespace
}  // namespace shmf

using shm::Result;
using shmf::misuse;

shmf_status shmf_decoder_new(const shmf_open_options* options, shmf_decoder** decoder,
                             shmf_error* error) {
  return shmf::guarded(error, [&]() -> Result<void> {
    if (decoder == nullptr) return misuse("the pointer for the handle is NULL");
    *decoder = nullptr;
    const auto own = shmf::taken_or_default(options, "options");
    if (!own) return own.error();
    if (own->damaged != 0) return misuse("a damaged stream cannot be decoded");
    *decoder = std::make_unique<shmf_decoder>(shmf::limits_of(*own)).release();
    return {};
  });
}

shmf_status shmf_decoder_feed(shmf_decoder* decoder, const void* bytes, uint64_t count,
                              shmf_error* error) {
  return shmf::guarded(error, [&]() -> Result<void> {
    if (decoder == nullptr) return misuse("the decoder is NULL");
    if (count == 0) {
      decoder->decoder.end_of_input();
      return {};
    }
    if (bytes == nullptr) return misuse("the bytes are NULL");
    return decoder->decoder.feed(
        std::span(static_cast<const std::byte*>(bytes), static_cast<std::size_t>(count)));
  });
}

shmf_status shmf_decoder_next(shmf_decoder* decoder, shmf_item* item, shmf_error* error) {
  return shmf::guarded(error, [&]() -> Result<void> {
    if (decoder == nullptr) return misuse("the decoder is NULL");
    if (item == nullptr) return misuse("the item is NULL");
    const auto own = shmf::next_item(*decoder);
    if (!own) return own.error();
    return shmf::give(item, *own, "the item");
  });
}

shmf_status shmf_decoder_info(const shmf_decoder* decoder, shmf_info* info, shmf_error* error) {
  return shmf::with_schema(decoder, error, [&](const shm::Schema& schema) {
    return shmf::give(info, shmf::info_of(schema), "info");
  });
}

shmf_status shmf_decoder_block(const shmf_decoder* decoder, uint32_t block, shmf_block* info,
                               shmf_error* error) {
  return shmf::with_schema(decoder, error, [&](const shm::Schema& schema) -> Result<void> {
    const auto own = shmf::block_of(schema, block);
    return own ? shmf::give(info, *own, "info") : own.error();
  });
}

shmf_status shmf_decoder_array(const shmf_decoder* decoder, uint32_t array, shmf_array* info,
                               shmf_error* error) {
  return shmf::with_schema(decoder, error, [&](const shm::Schema& schema) -> Result<void> {
    const auto own = shmf::array_of(schema, array);
    return own ? shmf::give(info, *own, "info") : own.error();
  });
}

void shmf_decoder_free(shmf_decoder* decoder) { delete decoder; }
