// Parity: data that repairs a file after sectors were lost. It consists of Reed-Solomon codes of
// the whole file, in packets after its trailer, which other readers ignore. spec: "Parity"
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

// Layout of the parity. The file is cut into blocks, and the blocks are distributed to stripes:
// block b belongs to stripe b % stripes(). So a loss in one place is spread over many stripes, and
// each stripe can recover as many lost blocks as it has parity blocks.
struct ParityShape {
  std::uint64_t protected_bytes = 0;
  std::uint32_t data = 0, parity = 0;  // blocks per stripe; together at most 255; parity <= data
  std::uint32_t millionths = 0;        // requested share; 0: unknown

  std::uint64_t blocks() const { return (protected_bytes - 1) / kParityBlockBytes + 1; }
  std::uint64_t stripes() const { return (blocks() - 1) / data + 1; }
  std::uint64_t checksum_packets() const { return (4 * blocks() - 1) / kParityBlockBytes + 1; }
  std::uint64_t parity_packets() const { return stripes() * parity; }
  bool operator==(const ParityShape&) const = default;
};
// Returns the layout for a file of `bytes` bytes (above 0). `share` is the number of parity bytes
// per byte of the file, above 0 and at most 1.
ParityShape parity_shape(std::uint64_t bytes, double share);

// Writes the parity of `file`, which ends with its trailer, to `out`; the parity must follow that
// trailer. Needs 16 MB of memory. Throws Failure; misuse if this was built without ISA-L. Returns
// the number of bytes written.
std::uint64_t write_parity(RandomSource& file, const ParityShape& shape, ByteSink& out,
                           const Progress& progress = {});

// Writes parity to `file`, after everything that has been written to it so far.
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
// chunk, so that nothing follows the trailer.
bool is_whole_file(RandomSource& file);

// A file followed by parity.
class ProtectedFile {
 public:
  // Returns null if the file has no parity. `file` is borrowed. Parts of the file that cannot be
  // read count as damaged.
  static std::unique_ptr<ProtectedFile> open(RandomSource& file);
  ~ProtectedFile();

  const ParityShape& shape() const { return shape_; }
  // Returns true if the trailer at the end of the file points beyond the protected bytes: the
  // packets were already part of a longer file.
  bool is_of_something_else();
  // Returns the requested number of parity bytes per byte of the file.
  double share() const;
  // Reads and checks all blocks and packets.
  void check(const Progress& progress = {});

  // After check(): returns the damaged blocks, and those whose checksum is unknown, ascending.
  const std::vector<std::uint64_t>& damaged_blocks() const { return damaged_; }
  // After check(): returns the number of damaged packets; the copy of the trailer after them counts
  // as one.
  std::uint64_t damaged_packets() const { return damaged_packets_; }

  // After check(): reconstructs damaged blocks as far as the parity suffices, and stores them in
  // `scratch`. Returns the blocks that could not be healed. Throws Failure.
  std::vector<std::uint64_t> heal(FileSink& scratch, const Progress& progress = {});
  // After heal(): returns the protected bytes with healed blocks in place of the damaged ones.
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
  std::vector<std::uint8_t> known_;  // by block: 1 if its checksum is known
  std::vector<std::uint64_t> damaged_;
  std::uint64_t damaged_packets_ = 0;
  std::unique_ptr<Healed> healed_;
};

}  // namespace shm::converters
