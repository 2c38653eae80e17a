// Reader and Decoder: decode a .shm file piece by piece. The memory needed depends on the size of
// the active surface and of one chunk, not on the size of the mesh. If the file has stepped arrays,
// Reader and Decoder also keep in memory the compressed connectivity, up to 64 MiB of
// neighbourhoods (ReadOptions::kept_topology_bytes), and up to three steps of all stepped arrays.
// Steps beyond 128 MiB are in a temporary file (ReadLimits::max_kept_steps_bytes).
// - Decoder (push): receives bytes and yields items. It uses no I/O other than this temporary file,
//   no threads, no global state.
// - Reader (pull): reads from a ByteSource and yields items. It uses threads if requested.
// spec: "Decoding a file"
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "shm/blocks.h"
#include "shm/io.h"
#include "shm/limits.h"
#include "shm/schema.h"

namespace shm {
namespace container {
struct Index;
}

/// One item of a file. A Decoder yields MeshBlocks, then StepPieces, and finally Totals. Extras and
/// StepTimes can occur between any of these items.
using Item = std::variant<MeshBlock, StepPiece, StepTimes, Extra, Totals>;

/// Decodes bytes that the caller feeds to it, in pieces of any size, even single bytes. After the
/// first error every call returns that error. A Decoder is not thread safe; distinct Decoders are
/// independent.
class SHM_API Decoder {
 public:
  explicit Decoder(const ReadLimits& limits = {});
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  enum class Progress : std::uint8_t {
    need_input,  ///< no item is ready; feed more bytes
    item_ready,  ///< take() returns an item
    finished,    ///< the input has ended, and the caller has taken all items
  };
  /// Copies `bytes` into the decoder's buffer. Apart from these bytes, the buffer contains at most
  /// one chunk.
  Result<void> feed(std::span<const std::byte> bytes);
  /// Declares the end of the input. If the end record is then missing, decoding fails with
  /// ErrorCode::truncated.
  void end_of_input();
  /// Decodes until an item is ready or more input is needed.
  Result<Progress> advance();
  /// Moves the ready item out of the decoder. Precondition: advance() returned item_ready.
  Item take();
  /// Hands back a block that the caller no longer needs, so that the decoder uses its memory for a
  /// later block. This call is optional and only saves time.
  void reuse(MeshBlock&& block);
  /// Returns the schema, or null until the schema has been decoded. The pointer remains valid until
  /// the decoder is destroyed.
  const Schema* schema() const;

 private:
  friend class Reader;
  friend class IndexBuilder;
  Decoder(const ReadLimits& limits, const ReadOptions& options);
  /// Returns an index with the totals of everything decoded so far. It contains neither chunk
  /// entries nor value ranges. Fails with ErrorCode::corrupt if step values are incomplete.
  Result<container::Index> held() const;

  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a whole file from a ByteSource through a Decoder.
class SHM_API Reader {
 public:
  /// Reads the file up to and including the schema. `source` is borrowed and must outlive the
  /// Reader.
  static Result<Reader> open(ByteSource& source, const ReadLimits& limits = {},
                             const ReadOptions& options = {});
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  const Schema& schema() const;
  /// Returns the next item; null at the end and in all later calls. The item is valid until the
  /// next call.
  Result<Item*> next();

 private:
  class Impl;
  explicit Reader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
