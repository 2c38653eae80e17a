// Reads files that end with parity packets. The packets have wrong contents but valid checksums.
// The target checks the packets and repairs damage if possible; repaired data must match its
// checksums.
#include "archive/parity.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <span>
#include <vector>

#include "base/failure.h"
#include "support/file_fields.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Bytes = std::vector<std::byte>;
using Random = std::minstd_rand;
using shm::converters::ProtectedFile;

void expect(bool good) {
  if (!good) std::abort();
}

void check_and_heal(shm::RandomSource& source) {
  (void)shm::converters::is_whole_file(source);
  const auto file = ProtectedFile::open(source);
  if (file == nullptr) return;
  const auto& shape = file->shape();
  expect(shape.protected_bytes <= source.size() && file->share() > 0);
  file->check();
  const auto& damaged = file->damaged_blocks();
  expect(std::is_sorted(damaged.begin(), damaged.end()));
  for (const std::uint64_t block : damaged) expect(block < shape.blocks());
  const auto scratch = shm::converters::unwrap(
      shm::FileSink::create_scratch(std::filesystem::temp_directory_path().string(), "fuzz"), {});
  const auto lost = file->heal(*scratch);
  for (const std::uint64_t block : lost)
    expect(std::binary_search(damaged.begin(), damaged.end(), block));
  shm::RandomSource& healed = file->healed();
  expect(healed.size() == shape.protected_bytes);
  Bytes all(static_cast<std::size_t>(healed.size()));
  expect(bool(healed.read_at(0, all)));
  // Reads the repaired data again, in pieces that cross the borders between parity blocks.
  for (std::size_t at = 0; at < all.size(); at += 1000) {
    Bytes piece(std::min<std::size_t>(1500, all.size() - at));
    expect(bool(healed.read_at(at, piece)));
    expect(std::equal(piece.begin(), piece.end(), all.begin() + static_cast<std::ptrdiff_t>(at)));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> file(data, data + size);
  shm::MemoryRandomSource source(std::as_bytes(std::span(file)));
  try {
    check_and_heal(source);
  } catch (const shm::converters::Failure&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  Random random(seed);
  const auto file = std::as_writable_bytes(std::span(data, size));
  const auto places = shm::parity_packets(file);
  if (places.empty() || random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
  if (random() % 3 == 0) {  // simulates lost sectors of a disk
    const std::size_t at = random() % size,
                      count = std::min<std::size_t>(size - at, random() % 5000);
    std::fill_n(data + at, count, static_cast<std::uint8_t>(random()));
    return size;
  }
  // Change a field of the header, or the payload, in one packet or in all packets.
  const bool all = random() % 2 == 0, payload = random() % 3 == 0;
  const std::size_t chosen = places[random() % places.size()], field = random(), way = random();
  for (const std::size_t at : places) {
    if (!all && at != chosen) continue;
    const shm::Section header = shm::parity_header(file, at);
    if (!payload) {
      const shm::Field& target = header.fields[field % header.fields.size()];
      shm::put_parity_header(file, at, shm::changed(header, target, way));
    } else if (size - at > shm::kPacketHeader) {
      const std::size_t behind = at + shm::kPacketHeader;
      data[behind + random() % (size - behind)] = static_cast<std::uint8_t>(random());
      shm::put_parity_header(file, at, header.bytes);
    }
  }
  return size;
}
