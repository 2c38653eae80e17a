// Passes arbitrary bytes to the Decoder. The Decoder must return an item, an error, or a request
// for more bytes. It must never crash, and its memory must be in proportion to the size of the
// input.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/reader.h"

namespace {

// Takes all items that the Decoder can return now. Returns false at the first error.
bool take_all(shm::Decoder& decoder) {
  for (;;) {
    const auto progress = decoder.advance();
    if (!progress) return false;
    if (*progress != shm::Decoder::Progress::item_ready) return true;
    const shm::Item item = decoder.take();
    const auto* block = std::get_if<shm::MeshBlock>(&item);
    if (block == nullptr) continue;
    std::uint64_t sum = 0;
    shm::for_each_event(*block, decoder.schema()->coordinate_type, [&](const shm::Event& event) {
      if (const auto* cell = std::get_if<shm::CellEvent>(&event))
        for (const std::uint64_t corner : cell->corners) sum += corner;
    });
    // Use the sum of the corners, so that the compiler does not remove the loop that reads them.
    volatile std::uint64_t used = sum;
    (void)used;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // The first byte sets the size of the pieces, so that pieces can end at every position of a file.
  const std::size_t piece = data[0] == 0 ? size : std::size_t{data[0]} * data[0];
  auto rest = std::as_bytes(std::span(data, size)).subspan(1);
  shm::ReadLimits limits;
  limits.max_active_vertices = 1 << 20;
  limits.max_chunk_bytes = 1 << 24;
  limits.max_extra_bytes = 1 << 24;
  shm::Decoder decoder(limits);
  while (!rest.empty()) {
    const std::size_t count = std::min(piece, rest.size());
    if (!decoder.feed(rest.first(count)) || !take_all(decoder)) return 0;
    rest = rest.subspan(count);
  }
  decoder.end_of_input();
  take_all(decoder);
  return 0;
}
