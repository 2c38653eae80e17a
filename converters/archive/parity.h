// Parity: what heals a file of which sectors were lost. Reed-Solomon codes over the whole file, in
// packets behind its trailer, where readers do not look. spec: "Parity"
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

// A file is cut into blocks, and these are dealt out to stripes: block b to stripe b % stripes().
// So what is lost in one place is lost by many stripes, each of which stands the loss of as many
// blocks as it has parity blocks.
struct ParityShape {
  std::uint64_t protected_bytes = 0;
  std::uint32_t data = 0, parity = 0;  // blocks of a stripe; 255 at most together, parity <= data
  std::uint32_t millionths = 0;        // the share that was asked for; 0: not known

  std::uint64_t blocks() const { return (protected_bytes - 1) / kParityBlockBytes + 1; }
  std::uint64_t stripes() const { return (blocks() - 1) / data + 1; }
  std::uint64_t checksum_packets() const { return (4 * blocks() - 1) / kParityBlockBytes + 1; }
  std::uint64_t parity_packets() const { return stripes() * parity; }
  bool operator==(const ParityShape&) const = default;
};
// `share`: bytes of parity for each byte of the file, above 0, 1 at most. `bytes` above 0.
ParityShape parity_shape(std::uint64_t bytes, double share);

// Writes what protects `file`, which ends with its trailer, and is to stand behind it. Takes 16 MB.
// Throws Failure, and where this was built without ISA-L as misuse. Returns how many bytes these
// are.
std::uint64_t write_parity(RandomSource& file, const ParityShape& shape, ByteSink& out,
                           const Progress& progress = {});

// The same behind what has been written to `file`.
std::uint64_t protect(OutputFile& file, double share, const Progress& progress = {});

// Whether this was built with what makes and uses parity (ISA-L).
bool has_parity_codes();

// How parity that stands behind a file is: what verify reports of it.
struct ParityState {
  bool there = false;
  std::uint64_t blocks = 0, damaged_blocks = 0, damaged_packets = 0;

  bool sound() const { return damaged_blocks == 0 && damaged_packets == 0; }
};

class LenientSource;
struct ParityPacket;

// Whether it begins as a .shm file does and ends with a trailer that stands behind its chunk: so
// nothing stands behind that.
bool is_whole_file(RandomSource& file);

// A file with parity behind it.
class ProtectedFile {
 public:
  // Null where there is no parity. `file` is borrowed. What of it cannot be read is taken for
  // damaged.
  static std::unique_ptr<ProtectedFile> open(RandomSource& file);
  ~ProtectedFile();

  const ParityShape& shape() const { return shape_; }
  // Whether the file ends beyond what is protected: the packets were there before.
  bool is_of_something_else();
  // Bytes of parity for each byte, as they were asked for.
  double share() const;
  // Reads all blocks and packets.
  void check(const Progress& progress = {});

  // After check(): blocks that are not what they were, or of which that is not known, ascending.
  const std::vector<std::uint64_t>& damaged_blocks() const { return damaged_; }
  // After check(): packets that are not what they were; the trailer behind them counts as one.
  std::uint64_t damaged_packets() const { return damaged_packets_; }

  // After check(): makes damaged blocks anew, as far as parity goes; `scratch` takes them. Returns
  // those that could not be healed. Throws Failure.
  std::vector<std::uint64_t> heal(FileSink& scratch, const Progress& progress = {});
  // After heal(): what is protected, healed blocks in place of damaged ones.
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
  std::vector<std::uint8_t> known_;  // of each block, whether its checksum is
  std::vector<std::uint64_t> damaged_;
  std::uint64_t damaged_packets_ = 0;
  std::unique_ptr<Healed> healed_;
};

}  // namespace shm::converters
