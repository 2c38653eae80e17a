// Parity: redundant data that can repair a file after some of its sectors were lost. Parity
// consists of Reed-Solomon codes of the whole file. The codes are stored in packets after the
// trailer of the file. Readers without parity support ignore these packets.
// spec: "Parity"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "base/progress.h"
#include "shm/io.h"

namespace shm::converters {

inline constexpr std::size_t kParityBlockBytes = 4096;

// Layout of the parity. The file is divided into blocks, and block b belongs to stripe b %
// stripes(). The loss of consecutive blocks is therefore spread over many stripes. Each stripe can
// recover one lost block for each of its parity blocks.
struct ParityShape {
  std::uint64_t protected_bytes = 0;
  std::uint32_t data = 0, parity = 0;  // number of data and parity blocks per stripe: data + parity
                                       // <= 255, parity <= data
  std::uint32_t millionths = 0;        // requested size of the parity in millionths of the file
                                       // size; 0: unknown

  std::uint64_t blocks() const { return (protected_bytes - 1) / kParityBlockBytes + 1; }
  std::uint64_t stripes() const { return (blocks() - 1) / data + 1; }
  std::uint64_t checksum_packets() const { return (4 * blocks() - 1) / kParityBlockBytes + 1; }
  std::uint64_t parity_packets() const { return stripes() * parity; }
  bool operator==(const ParityShape&) const = default;
};
// Returns the layout for a file of `bytes` bytes; `bytes` must exceed 0. `share` is the number of
// parity bytes per byte of the file, above 0 and at most 1.
ParityShape parity_shape(std::uint64_t bytes, double share);

// Writes the parity of `file` to `out`. `file` must end with its trailer, and the caller must store
// the parity directly after this trailer. Needs 16 MB of memory. Throws Failure; its code is misuse
// if the converters were built without ISA-L. Returns the number of bytes written.
std::uint64_t write_parity(RandomSource& file, const ParityShape& shape, ByteSink& out,
                           const Progress& progress = {});

// Computes the parity of all data that has been written to `file` so far, and appends the parity to
// `file`. Returns the size of the parity in bytes.
std::uint64_t protect(OutputFile& file, double share, const Progress& progress = {});

// Returns true if the converters were built with ISA-L, which is needed to create and use parity.
bool has_parity_codes();

// State of the parity of a file, as reported by verify.
struct ParityState {
  bool there = false;
  std::uint64_t blocks = 0, damaged_blocks = 0, damaged_packets = 0;

  bool sound() const { return damaged_blocks == 0 && damaged_packets == 0; }
};

class LenientSource;
struct ParityPacket;

// Returns true if the file begins like a .shm file, and ends with a trailer that directly follows
// the index chunk. Such a file has no parity and no other data after the trailer.
bool is_whole_file(RandomSource& file);

// A .shm file with parity after its trailer.
class ProtectedFile {
 public:
  // Opens a file with parity. Returns null if the file has no parity. `file` is borrowed. Parts of
  // the file that cannot be read are treated as damaged.
  static std::unique_ptr<ProtectedFile> open(RandomSource& file);
  ~ProtectedFile();

  const ParityShape& shape() const { return shape_; }
  // Returns true if the trailer at the end of the file points beyond the protected bytes. In this
  // case the file has grown since the parity was written, so the parity does not cover the whole
  // file.
  bool is_of_something_else();
  // Returns the requested number of parity bytes per byte of the file.
  double share() const;
  // Reads and checks all blocks and packets.
  void check(const Progress& progress = {});

  // Returns the indices of all blocks that are damaged or whose checksum is unknown, in ascending
  // order. Precondition: check() was called.
  const std::vector<std::uint64_t>& damaged_blocks() const { return damaged_; }
  // Returns the number of damaged packets. The copy of the trailer after the packets counts as a
  // packet. Precondition: check() was called.
  std::uint64_t damaged_packets() const { return damaged_packets_; }

  // Reconstructs damaged blocks if the parity suffices, and stores them in `scratch`. Returns the
  // blocks that could not be repaired. Precondition: check() was called. Throws Failure.
  std::vector<std::uint64_t> heal(FileSink& scratch, const Progress& progress = {});
  // Returns a source of the protected bytes, in which repaired blocks replace damaged blocks.
  // Precondition: heal() was called.
  RandomSource& healed();

 private:
  class Healed;

  explicit ProtectedFile(RandomSource& file);
  bool find();
  bool read_packet(const ParityPacket& wanted, std::vector<std::byte>& payload);
  std::vector<std::uint64_t> heal_stripe(std::uint64_t stripe,
                                         std::span<const std::uint64_t> damaged, FileSink& scratch);
  std::vector<std::byte> read_block(std::uint64_t block);
  bool trailer_is_there();

  std::unique_ptr<LenientSource> file_;
  ParityShape shape_;
  std::uint32_t set_ = 0;
  std::vector<std::uint32_t> checksums_;
  std::vector<std::uint8_t> known_;  // for each block: 1 if its checksum is known, otherwise 0
  std::vector<std::uint64_t> damaged_;
  std::uint64_t damaged_packets_ = 0;
  std::unique_ptr<Healed> healed_;
};

}  // namespace shm::converters
