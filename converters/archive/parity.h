// Parity: data that can repair a file after sectors were lost. It consists of Reed-Solomon codes of
// the whole file, in packets after its trailer, which other readers ignore.
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

// Layout of the parity. The file is divided into blocks, and the blocks are distributed to stripes:
// block b belongs to stripe b % stripes(). A loss in one place is therefore spread over many
// stripes. Each stripe can recover at most as many lost blocks as it has parity blocks.
struct ParityShape {
  std::uint64_t protected_bytes = 0;
  std::uint32_t data = 0, parity = 0;  // number of data and parity blocks per stripe: data + parity
                                       // <= 255, parity <= data
  std::uint32_t millionths = 0;        // requested share in millionths of the file size; 0: unknown

  std::uint64_t blocks() const { return (protected_bytes - 1) / kParityBlockBytes + 1; }
  std::uint64_t stripes() const { return (blocks() - 1) / data + 1; }
  std::uint64_t checksum_packets() const { return (4 * blocks() - 1) / kParityBlockBytes + 1; }
  std::uint64_t parity_packets() const { return stripes() * parity; }
  bool operator==(const ParityShape&) const = default;
};
// Returns the layout for a file of `bytes` bytes; `bytes` must exceed 0. `share` is the number of
// parity bytes per byte of the file, above 0 and at most 1.
ParityShape parity_shape(std::uint64_t bytes, double share);

// Writes the parity of `file`, which ends with its trailer, to `out`. The parity must be stored
// directly after this trailer. Needs 16 MB of memory. Throws Failure; its code is misuse if this
// was built without ISA-L. Returns the number of bytes written.
std::uint64_t write_parity(RandomSource& file, const ParityShape& shape, ByteSink& out,
                           const Progress& progress = {});

// Writes the parity of all data that has been written to `file` so far, and appends it to `file`.
std::uint64_t protect(OutputFile& file, double share, const Progress& progress = {});

// Returns true if this was built with ISA-L, which creates and uses parity.
bool has_parity_codes();

// State of the parity of a file, as reported by verify.
struct ParityState {
  bool there = false;
  std::uint64_t blocks = 0, damaged_blocks = 0, damaged_packets = 0;

  bool sound() const { return damaged_blocks == 0 && damaged_packets == 0; }
};

class LenientSource;
struct ParityPacket;

// Returns true if the file begins like a .shm file and ends with a trailer directly after the index
// chunk. Such a file has no data after the trailer.
bool is_whole_file(RandomSource& file);

// A file that is followed by parity.
class ProtectedFile {
 public:
  // Opens a file with parity. Returns null if the file has no parity. `file` is borrowed. Parts of
  // the file that cannot be read are treated as damaged.
  static std::unique_ptr<ProtectedFile> open(RandomSource& file);
  ~ProtectedFile();

  const ParityShape& shape() const { return shape_; }
  // Returns true if the trailer at the end of the file points beyond the protected bytes. The
  // packets then belong to an older state of a file that has become longer.
  bool is_of_something_else();
  // Returns the requested number of parity bytes per byte of the file.
  double share() const;
  // Reads and checks all blocks and packets.
  void check(const Progress& progress = {});

  // Returns the damaged blocks, and the blocks whose checksum is unknown, in ascending order.
  // Requires check().
  const std::vector<std::uint64_t>& damaged_blocks() const { return damaged_; }
  // Returns the number of damaged packets. The copy of the trailer after the packets counts as a
  // packet. Requires check().
  std::uint64_t damaged_packets() const { return damaged_packets_; }

  // Reconstructs damaged blocks if the parity suffices, and stores them in `scratch`. Returns the
  // blocks that could not be healed. Requires check(). Throws Failure.
  std::vector<std::uint64_t> heal(FileSink& scratch, const Progress& progress = {});
  // Returns the protected bytes, in which healed blocks replace damaged blocks. Requires heal().
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
  std::vector<std::uint8_t> known_;  // 1 for each block whose checksum is known
  std::vector<std::uint64_t> damaged_;
  std::uint64_t damaged_packets_ = 0;
  std::unique_ptr<Healed> healed_;
};

}  // namespace shm::converters
