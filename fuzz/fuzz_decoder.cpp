// Passes damaged files with valid checksums (damaged_file.h) to the Decoder, in pieces whose sizes
// depend on the input. The Decoder must return an item, an error or a request for more bytes, and
// the results must be the same for all piece sizes. The Decoder must never crash, and its memory
// must be in proportion to the size of the input. If both read_summary and the Decoder accept a
// file, their counts must agree. It must be possible to write all valid sets of a file again. An
// input consists of one byte, the random seed for the piece sizes, and a file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "damaged_file.h"
#include "shm/sets.h"
#include "shm/summary.h"

namespace {

using shm_fuzz::Bytes, shm_fuzz::Random;

// --- the target

/// Hash of all results of the Decoder.
class Outcome {
 public:
  void add(std::span<const std::byte> bytes) {
    for (const std::byte b : bytes) add_number(std::to_integer<std::uint64_t>(b));
  }
  template <class T>
  void add_all(const std::vector<T>& values) {
    add_number(values.size());
    add(std::as_bytes(std::span(values)));
  }
  void add_number(std::uint64_t number) { hash_ = (hash_ ^ number) * 0x100000001b3; }
  void add_item(const shm::Item& item) {
    add_number(item.index());
    if (const auto* block = std::get_if<shm::MeshBlock>(&item)) add_block(*block);
    if (const auto* piece = std::get_if<shm::StepPiece>(&item)) add_all(piece->values);
    if (const auto* times = std::get_if<shm::StepTimes>(&item)) add_all(times->times);
    if (const auto* extra = std::get_if<shm::Extra>(&item)) add_all(extra->data);
    if (const auto* totals = std::get_if<shm::Totals>(&item)) totals_ = *totals;
  }
  const std::optional<shm::Totals>& totals() const { return totals_; }
  bool operator==(const Outcome& other) const {
    return hash_ == other.hash_ && same(totals_, other.totals_);
  }
  static bool same(const std::optional<shm::Totals>& a, const std::optional<shm::Totals>& b) {
    if (!a || !b) return !a && !b;
    const auto numbers = [](const shm::Totals& counts) {
      return std::tie(counts.vertices, counts.cells, counts.hexahedra, counts.max_active_vertices,
                      counts.segment_starts, counts.segment_connectivity, counts.imported_vertices,
                      counts.total_bytes, counts.streams, counts.steps, counts.block_cells,
                      counts.trailing_bytes);
    };
    return numbers(*a) == numbers(*b);
  }

 private:
  void add_block(const shm::MeshBlock& block) {
    add_all(block.vertex_numbers);
    add_all(block.xyz);
    add_all(block.cell_numbers);
    add_all(block.cell_blocks);
    add_all(block.corner_begin);
    add_all(block.corners);
    add_all(block.last_use);
    add_all(block.vertices_before_cell);
    for (const Bytes& values : block.arrays) add_all(values);
  }
  std::uint64_t hash_ = 0xcbf29ce484222325;
  std::optional<shm::Totals> totals_;
};

/// Checks the properties of a block that the Decoder guarantees to its callers.
void check_block(const shm::MeshBlock& block, const shm::Schema& schema) {
  const auto expect = [](bool good) {
    if (!good) std::abort();
  };
  const std::size_t cells = block.cell_count();
  expect(block.cell_numbers.size() == cells && block.last_use.size() == cells);
  expect(block.vertices_before_cell.size() == cells && block.corner_begin.size() == cells + 1);
  expect(block.corner_begin.back() == block.corners.size());
  expect(block.xyz.size() == block.vertex_count() * 3 * shm::scalar_bytes(schema.coordinate_type));
  std::vector<std::uint64_t> covered(schema.arrays.size());
  for (std::size_t c = 0; c < cells; ++c) {
    const std::uint32_t b = block.cell_blocks[c];
    expect(b < schema.blocks.size() && block.corner_begin[c] <= block.corner_begin[c + 1]);
    expect(block.vertices_before_cell[c] <= block.vertex_count());
    const std::uint64_t nodes = block.corner_begin[c + 1] - block.corner_begin[c];
    expect(schema.blocks[b].nodes_per_cell == 0 || nodes == schema.blocks[b].nodes_per_cell);
    expect(nodes >= 64 || block.last_use[c] >> nodes == 0);
    for (std::size_t a = 0; a < covered.size(); ++a)
      if (schema.array_covers(a, b)) ++covered[a];
  }
  for (std::size_t a = 0; a < covered.size(); ++a) {
    const shm::ArrayInfo& info = schema.arrays[a];
    const std::uint64_t elements = info.per_step                           ? 0
                                   : info.location == shm::Location::point ? block.vertex_count()
                                                                           : covered[a];
    expect(block.arrays[a].size() == elements * info.components * shm::scalar_bytes(info.type));
  }
}

Outcome decode(std::span<const std::byte> bytes, std::uint32_t seed) {
  shm::Decoder decoder(shm_fuzz::small_limits());
  Random random(seed);
  Outcome outcome;
  const auto failed = [&](const shm::Error& error) {
    outcome.add(std::as_bytes(std::span<const char>(error.message())));
    return outcome;
  };
  bool ended = false;
  while (true) {
    const auto progress = decoder.advance();
    if (!progress) return failed(progress.error());
    if (*progress == shm::Decoder::Progress::finished) return outcome;
    if (*progress == shm::Decoder::Progress::item_ready) {
      const shm::Item item = decoder.take();
      if (const auto* block = std::get_if<shm::MeshBlock>(&item))
        check_block(*block, *decoder.schema());
      outcome.add_item(item);
    } else if (!bytes.empty()) {
      const std::size_t wish = seed == 0 ? bytes.size() : random() % (1u << (random() % 12));
      const auto piece = bytes.first(std::min(wish, bytes.size()));
      if (auto status = decoder.feed(piece); !status) return failed(status.error());
      bytes = bytes.subspan(piece.size());
    } else {
      if (std::exchange(ended, true)) std::abort();  // no data may be requested after the end
      decoder.end_of_input();
    }
  }
}

/// Checks that the valid sets of a file can be written again.
void read_sets(const shm::Summary& summary) {
  const shm::Totals& totals = summary.totals;
  const auto sets = shm::sets_of_extras(
      summary.extras, {totals.vertices, totals.cells, summary.schema.blocks.size()});
  if (sets && !shm::extras_of_sets(*sets)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes bytes(reinterpret_cast<const std::byte*>(data) + 1,
                    reinterpret_cast<const std::byte*>(data) + size);
  const Outcome outcome = decode(bytes, data[0]);
  if (data[0] % 4 == 1 && !(decode(bytes, 0) == outcome)) std::abort();
  shm::MemoryRandomSource source(bytes);
  const auto summary = shm::read_summary(source, shm_fuzz::small_limits());
  if (summary && outcome.totals() && !Outcome::same(summary->totals, outcome.totals()))
    std::abort();
  if (summary) read_sets(*summary);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
