#include "mpi/decompress.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/failure.h"
#include "base/output_file.h"
#include "compression/piece_mesh.h"
#include "exodus/parts/owners.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "mesh/blocks_by_id.h"
#include "shm/mesh_extract.h"
#include "tool/destination.h"
#include "tool/report.h"
#include "transfer/piece_output.h"
#include "transfer/translate.h"

namespace shm::converters {
namespace {

// --- messages between ranks

// Collective. Returns the items of all ranks, in the order of ranks, on every rank. Use it only for
// short lists, because every rank stores the items of all ranks.
template <class Item>
std::vector<Item> united(Ranks& ranks, const std::vector<Item>& mine) {
  std::vector<Item> all;
  for (const auto& part : ranks.exchange(std::vector<std::vector<Item>>(ranks.size(), mine)))
    for (const Item& item : part) all.push_back(item);
  return all;
}

// Collective. Merges the lists of lost data of all ranks and removes duplicates. Returns the result
// on rank 0, and an empty list on the other ranks.
LossList united_losses(Ranks& ranks, const LossList& mine) {
  std::string text;
  for (const std::string& loss : mine) text += loss + '\n';
  LossList all;
  ranks.gather(std::as_bytes(std::span(text)), [&](std::size_t, const std::vector<std::byte>& got) {
    std::string sentence;
    for (const std::byte byte : got) {
      const char c = static_cast<char>(byte);
      if (c != '\n') {
        sentence += c;
      } else {
        if (std::find(all.begin(), all.end(), sentence) == all.end()) all.push_back(sentence);
        sentence.clear();
      }
    }
  });
  return all;
}

// --- the part of a rank

class Part {
 public:
  Part(Ranks& ranks, const DecompressCommand& options, Spool& spool)
      : ranks_(ranks), options_(options), format_(*format_named("exodus")), spool_(spool) {}

  // Collective. Call these functions in this order.
  void decode();
  void agree_on_blocks();
  void count_vertices();
  LossList translate();
  void write();
  std::string summary() const;

 private:
  void open();
  void stage();
  void check_blocks() const;

  Ranks& ranks_;
  const DecompressCommand& options_;
  const Format& format_;
  Spool& spool_;
  Capabilities capabilities_;
  std::unique_ptr<FileRandomSource> file_;
  std::optional<MeshExtractor> extractor_;
  MeshInfo whole_;  // schema, counts, times and extras of the whole mesh
  CellRange range_;
  std::unique_ptr<PieceMesh> piece_;
  // Blocks of all ranks. Empty if no array contains the block ids.
  std::vector<BlocksById::Key> blocks_;
  std::uint64_t lost_vertices_ = 0;
  std::optional<Translation> translation_;
};

void Part::open() {
  if (options_.input == "-" || options_.output == "-")
    wrong_use("shm_mpi cannot use standard input or standard output: IN and OUT must be files");
  if (output_format(options_.output, options_.format).name != "exodus")
    wrong_use("shm_mpi decompress writes only Exodus files: name the output " + options_.output +
              ".e, or use --format exodus");
  check_places({{options_.input}, part_name(options_.output, ranks_.size(), ranks_.rank())},
               options_.force);
  const std::string& path = options_.input;
  require_shm(path);
  require_no_archive(path);
  file_ = unwrap(FileRandomSource::open(path), path);
  extractor_.emplace(unwrap(MeshExtractor::open(*file_), path));
  whole_ = info_of(*extractor_, path);
  capabilities_ = format_.capabilities;
  capabilities_.sibling = {};
}

void Part::check_blocks() const {
  for (std::size_t b = 0; b < whole_.block_cells.size(); ++b) {
    const BlockInfo& block = whole_.schema.blocks[b];
    if (block.nodes_per_cell == 0 && block.shape != CellShape::polygon && whole_.block_cells[b] > 0)
      throw Failure(Error{
          .code = ErrorCode::unsupported,
          .detail = "its cells have different numbers of vertices, which parts do not support; "
                    "shm decompress writes one file",
          .section = "block " + std::to_string(block.id),
          .file = options_.input});
  }
}

void Part::stage() {
  PieceOptions how;
  how.maps = capabilities_.maps;
  how.decomposed = true;
  range_ = part_range(extractor_->segments(), whole_.cells(), ranks_.size(), ranks_.rank());
  const bool last = range_.end == whole_.cells();
  if (whole_.cells() == 0 && ranks_.first())
    how.request.unused_vertices = true;  // this single part is the whole mesh
  else if (range_.empty())
    how.request.cells.numbers.emplace();  // select no cells, by an empty list
  else
    how.request.cells.range = CellSelection::Range{range_.first, range_.end};
  how.request.unused_vertices |= last;
  MeshInfo of_piece = whole_;
  const std::vector<MeshSet> sets = take_sets(of_piece);
  piece_ = std::make_unique<PieceMesh>(*extractor_, how, std::move(of_piece.extras), sets,
                                       options_.input, spool_);
  if (piece_->info().cells() != range_.end - range_.first)
    throw Failure(Error{.code = ErrorCode::corrupt,
                        .detail = "names cells that do not exist",
                        .section = "index",
                        .file = options_.input});
}

void Part::decode() {
  ranks_.together([&] {
    open();
    check_blocks();
  });
  ranks_.together([&] { stage(); });
}

// Collective. Merges the lists of blocks of all ranks, so that all ranks have the same list. This
// is necessary if an array contains the block ids, because the list then depends on the cells of
// all ranks.
void Part::agree_on_blocks() {
  const std::size_t array = BlocksById::array_of_ids(piece_->info());
  if (array == piece_->info().schema.arrays.size()) return;  // all ranks return here, or none
  std::vector<BlocksById::Key> mine;
  ranks_.together([&] { mine = BlocksById(*piece_, array, {}).keys(); });
  blocks_ = united(ranks_, mine);
}

// Collective. Counts the vertices of the whole mesh that are not in any part, because no cell uses
// them and the program that wrote the file coded them before the last cells.
void Part::count_vertices() {
  struct Had {
    std::uint64_t number = 0;
  };
  NumberOwners owners(ranks_, whole_.vertices);
  std::vector<Had> mine;
  std::vector<bool> had;
  ranks_.together([&] {
    for (const std::uint64_t number : piece_->vertex_numbers()) {
      if (number >= whole_.vertices)
        throw Failure(Error{.code = ErrorCode::corrupt,
                            .detail = "vertex " + std::to_string(number) +
                                      " is outside the mesh, which has " +
                                      std::to_string(whole_.vertices),
                            .section = "mesh",
                            .file = options_.input});
      mine.push_back({number});
    }
    had.resize(owners.count());
  });
  owners.send(mine, [&](const Had& item) { had[item.number - owners.first()] = true; });
  const auto missing = static_cast<std::uint64_t>(std::count(had.begin(), had.end(), false));
  lost_vertices_ = ranks_.sums({missing}).all[0];
}

LossList Part::translate() {
  LossList losses;
  ranks_.together([&] {
    translation_.emplace(*piece_, std::string(format_.name), capabilities_,
                         options_.steps.in(whole_.step_times), spool_, blocks_);
    losses = translation_->losses();
    for (const std::string& set : piece_->without_factors())
      losses.push_back("distribution factors of " + set);
    for (const std::string& array : piece_->without_sets())
      losses.push_back("array '" + array + "', because its sets have other members");
    if (lost_vertices_ > 0)
      losses.push_back(std::to_string(lost_vertices_) + " vertices that no cell uses");
  });
  return united_losses(ranks_, losses);
}

void Part::write() {
  const std::string path = part_name(options_.output, ranks_.size(), ranks_.rank());
  std::optional<OutputFile> output;
  ranks_.together([&] { output.emplace(path, "", format_.temporary); });
  ranks_.together([&] { write_mesh(translation_->mesh(), *output, format_, spool_); });
  bool named = false;
  try {
    ranks_.together([&] {
      output->commit();
      named = true;
    });
  } catch (const SharedFailure&) {
    std::error_code none;
    if (named) std::filesystem::remove(path, none);
    throw;
  }
}

std::string Part::summary() const {
  return part_name(options_.output, ranks_.size(), 0) + " to " +
         part_name(options_.output, ranks_.size(), ranks_.size() - 1) + ": " + counts_text(whole_) +
         "\n";
}

}  // namespace

CellRange part_range(const std::vector<SegmentInfo>& segments, std::uint64_t cells,
                     std::size_t parts, std::size_t part) {
  const std::uint64_t each = cells / parts, over = cells % parts;
  const auto cut = [&](std::uint64_t boundary) {
    const std::uint64_t even = each * boundary + std::min(boundary, over);
    if (boundary == 0 || boundary >= parts) return even;
    std::uint64_t best = even, distance = each / 4;
    for (const SegmentInfo& segment : segments) {
      const std::uint64_t first = segment.first_cell;
      const std::uint64_t away = first < even ? even - first : first - even;
      if (away > distance || first > cells) continue;
      best = first;
      distance = away;
    }
    return best;
  };
  return {cut(part), cut(part + 1)};
}

ExitCode decompress_with_ranks(Ranks& ranks, const DecompressCommand& command) {
  std::optional<Spool> spool;
  ranks.together([&] { spool.emplace(spool_directory(command), spool_memory(command)); });
  Part part(ranks, command, *spool);
  part.decode();
  part.agree_on_blocks();
  part.count_vertices();
  const LossList losses = part.translate();
  if (ranks.first()) report_losses(losses, command.output);
  if (ranks.broadcast(std::uint64_t{command.strict && !losses.empty()}) != 0) return kIncomplete;
  part.write();
  if (ranks.first()) print(command, part.summary());
  return kDone;
}

}  // namespace shm::converters
