// Implements shmf_select(), shmf_read() and shmf_verify().
#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cell_types.h"
#include "ends.h"
#include "file.h"
#include "shm/reader.h"
#include "shm/summary.h"
#include "structs.h"
#include "targets.h"

namespace shmf {
namespace {

using shm::MeshBlock;
using shm::Result;

/// Returns the index, in the selected piece, of the vertex or cell that has the number `number` in
/// the file. Returns nothing if the piece does not contain it.
std::optional<std::uint64_t> position(const std::vector<std::uint64_t>& numbers, bool whole,
                                      std::uint64_t count, std::uint64_t number) {
  if (whole) return number < count ? std::optional(number) : std::nullopt;
  const auto found = std::lower_bound(numbers.begin(), numbers.end(), number);
  if (found == numbers.end() || *found != number) return std::nullopt;
  return static_cast<std::uint64_t>(found - numbers.begin());
}

/// Reads the mesh in one pass, and fills the targets for vertices, cells and static arrays.
class MeshPass {
 public:
  /// The file and the targets are borrowed. If `coordinates` is true, coordinates are read even if
  /// no target needs them. If `keep_blocks` is true, cell_blocks() returns the block indices.
  MeshPass(shmf_file& file, std::span<Target> targets, bool coordinates, bool keep_blocks);
  Result<void> run(Watch& watch, double all, const shm::ReadOptions& options);

  /// Returns the block index of each cell; empty unless `keep_blocks` was true.
  const std::vector<std::uint32_t>& cell_blocks() const { return cell_blocks_; }

 private:
  /// A target that is being filled. `count`: number of its elements that have been filled. `taken`:
  /// for a static cell array, number of values of the current block that have been used.
  struct Filled {
    Target* target;
    std::uint64_t count = 0;
    std::size_t taken = 0;
  };
  const Piece& piece() const { return file_->piece; }
  bool covers(const Filled& filled, std::uint32_t block) const {
    return file_->schema().array_covers(filled.target->array(), block);
  }
  Result<void> take_vertices(const MeshBlock& block);
  Result<void> take_cells(const MeshBlock& block);
  /// Appends cells `first` to `end` - 1 of a block to the targets.
  Result<void> append(const MeshBlock& block, std::size_t first, std::size_t end,
                      std::span<Filled> cells);
  Result<void> append_corners(const MeshBlock& block, std::size_t first, std::size_t end,
                              Target& target);
  Result<void> append_values(const MeshBlock& block, std::size_t first, std::size_t end,
                             Filled& filled);
  Result<void> append_waiting();
  MeshBlock alone(const MeshBlock& block, std::size_t cell);
  /// Returns true if `cell` of `block` is the next cell to be appended (`ahead` = 0), or the cell
  /// that must be appended `ahead` cells later.
  bool follows(const MeshBlock& block, std::size_t cell, std::size_t ahead) const {
    const std::uint64_t next = next_cell_ + ahead;
    if (next >= piece().cell_count) return false;
    const std::uint64_t number =
        piece().whole ? next : piece().numbers[static_cast<std::size_t>(next)];
    return block.cell_numbers[cell] == number;
  }

  shmf_file* file_;
  bool coordinates_, keep_blocks_;
  std::vector<Filled> vertices_, cells_;
  std::vector<std::uint32_t> arrays_;  // indices of the static arrays to be read
  // VTK cell type of the cells of each block; 0: the type depends on the number of nodes of each
  // cell
  std::vector<std::uint8_t> types_;
  // for each vertex of the current block: its index in the selected piece
  std::vector<std::uint64_t> places_;
  std::uint64_t vertices_done_ = 0, next_cell_ = 0, next_corner_ = 0;
  std::vector<std::uint32_t> cell_blocks_;
  std::map<std::uint64_t, MeshBlock>
      waiting_;  // cells, by cell number, that must wait because cells with smaller numbers have
                 // not been decoded yet
};

MeshPass::MeshPass(shmf_file& file, std::span<Target> targets, bool coordinates, bool keep_blocks)
    : file_(&file), coordinates_(coordinates), keep_blocks_(keep_blocks) {
  for (Target& target : targets) {
    if (!target.wanted() || target.is_stepped()) continue;
    (target.of_cells() ? cells_ : vertices_).push_back({&target});
    if (target.what() == SHMF_POINTS) coordinates_ = true;
    if (target.what() == SHMF_VALUES) arrays_.push_back(target.array());
  }
  std::sort(arrays_.begin(), arrays_.end());
  arrays_.erase(std::unique(arrays_.begin(), arrays_.end()), arrays_.end());
  for (const shm::BlockInfo& block : file.schema().blocks)
    types_.push_back(block.nodes_per_cell == 0 ? std::uint8_t{0}
                                               : vtk_cell_type(block, block.nodes_per_cell));
}

Result<void> MeshPass::run(Watch& watch, double all, const shm::ReadOptions& options) {
  shm::ExtractRequest request;
  request.cells = piece().cells;
  request.arrays = arrays_;
  request.coordinates = coordinates_;
  if (auto status = file_->mesh->begin(request, options); !status) return status;
  while (true) {
    const auto part = file_->mesh->next();
    if (!part) return part.error();
    if (*part == nullptr) break;
    if (auto status = take_vertices(**part); !status) return status;
    if (auto status = take_cells(**part); !status) return status;
    if (auto status = watch.tell(static_cast<double>(vertices_done_ + next_cell_), all); !status)
      return status;
  }
  if (vertices_done_ != piece().vertex_count || next_cell_ != piece().cell_count ||
      next_corner_ != piece().corner_count)
    return corrupt("the index states more elements than the file contains", "index");
  for (Filled& filled : cells_) {
    if (filled.target->what() == SHMF_CORNER_BEGIN)
      filled.target->put_number(next_cell_, next_corner_);
    if (filled.target->what() == SHMF_VALUES && filled.count != filled.target->elements())
      return corrupt("the index states more cells of a block than the file contains", "index");
  }
  return {};
}

Result<void> MeshPass::take_vertices(const MeshBlock& block) {
  const std::size_t count = block.vertex_count();
  if (count > piece().vertex_count - vertices_done_)
    return corrupt("the index states fewer vertices than the file contains", "index");
  vertices_done_ += count;
  if (vertices_.empty()) return {};
  places_.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    const auto place =
        position(piece().vertices, piece().whole, piece().vertex_count, block.vertex_numbers[v]);
    if (!place)
      return corrupt("there is a vertex " + std::to_string(block.vertex_numbers[v]) +
                         ", the number of vertices is " + std::to_string(piece().vertex_count),
                     "mesh");
    places_[v] = *place;
  }
  for (Filled& filled : vertices_) {
    Target& target = *filled.target;
    if (target.what() == SHMF_VERTEX_NUMBERS) {
      for (std::size_t v = 0; v < count; ++v)
        target.put_number(places_[v], block.vertex_numbers[v]);
      continue;
    }
    const auto& values = target.what() == SHMF_POINTS ? block.xyz : block.arrays[target.array()];
    for (std::size_t v = 0; v < count;) {  // for each run of consecutive positions
      std::size_t end = v + 1;
      while (end < count && places_[end] == places_[v] + (end - v)) ++end;
      target.put_values(places_[v], values.data() + v * target.stride(), end - v);
      v = end;
    }
  }
  return {};
}

Result<void> MeshPass::take_cells(const MeshBlock& block) {
  for (Filled& filled : cells_) filled.taken = 0;
  for (std::size_t cell = 0; cell < block.cell_count();) {
    std::size_t end = cell;
    while (end < block.cell_count() && follows(block, end, end - cell)) ++end;
    if (end > cell) {
      if (auto status = append(block, cell, end, cells_); !status) return status;
      if (auto status = append_waiting(); !status) return status;
      cell = end;
      continue;
    }
    if (waiting_.size() >= piece().cell_count - next_cell_)
      return corrupt("the index states fewer cells than the file contains", "index");
    const std::uint64_t number = block.cell_numbers[cell];
    if (!waiting_.try_emplace(number, alone(block, cell)).second)
      return corrupt("cell " + std::to_string(number) + " occurs twice", "mesh");
    ++cell;
  }
  return {};
}

/// Returns a copy of `block` that contains only the cell `cell` and its requested values.
MeshBlock MeshPass::alone(const MeshBlock& block, std::size_t cell) {
  MeshBlock own;
  const auto corner = [&](std::size_t i) {
    return block.corners.begin() + static_cast<std::ptrdiff_t>(block.corner_begin[i]);
  };
  own.cell_numbers = {block.cell_numbers[cell]};
  own.cell_blocks = {block.cell_blocks[cell]};
  own.corners.assign(corner(cell), corner(cell + 1));
  own.corner_begin = {0, own.corners.size()};
  own.arrays.resize(block.arrays.size());
  for (Filled& filled : cells_) {
    const Target& target = *filled.target;
    if (target.what() != SHMF_VALUES || !covers(filled, block.cell_blocks[cell])) continue;
    const std::byte* from = block.arrays[target.array()].data() + filled.taken++ * target.stride();
    own.arrays[target.array()].assign(from, from + target.stride());
  }
  return own;
}

Result<void> MeshPass::append_waiting() {
  while (!waiting_.empty()) {
    const MeshBlock& next = waiting_.begin()->second;
    if (!follows(next, 0, 0)) break;
    // `next` contains a single cell, so the values of this cell are the first values of the block
    std::vector<Filled> cells = cells_;
    for (Filled& filled : cells) filled.taken = 0;
    if (auto status = append(next, 0, 1, cells); !status) return status;
    for (std::size_t i = 0; i < cells.size(); ++i) cells_[i].count = cells[i].count;
    waiting_.erase(waiting_.begin());
  }
  return {};
}

Result<void> MeshPass::append(const MeshBlock& block, std::size_t first, std::size_t end,
                              std::span<Filled> cells) {
  const std::uint64_t corners = block.corner_begin[end] - block.corner_begin[first];
  if (corners > piece().corner_count - next_corner_)
    return corrupt("the index states fewer corners than the file contains", "index");
  for (Filled& filled : cells) {
    Target& target = *filled.target;
    switch (target.what()) {
      case SHMF_CORNERS:
        if (auto status = append_corners(block, first, end, target); !status) return status;
        break;
      case SHMF_CORNER_BEGIN:
        for (std::size_t c = first; c < end; ++c)
          target.put_number(next_cell_ + (c - first),
                            next_corner_ + (block.corner_begin[c] - block.corner_begin[first]));
        break;
      case SHMF_CELL_BLOCKS:
        for (std::size_t c = first; c < end; ++c)
          target.put_number(next_cell_ + (c - first), block.cell_blocks[c]);
        break;
      case SHMF_CELL_TYPES:
        for (std::size_t c = first; c < end; ++c) {
          const std::uint32_t b = block.cell_blocks[c];
          const std::uint64_t nodes = block.corner_begin[c + 1] - block.corner_begin[c];
          target.put_byte(
              next_cell_ + (c - first),
              types_[b] != 0 ? types_[b] : vtk_cell_type(file_->schema().blocks[b], nodes));
        }
        break;
      case SHMF_CELL_NUMBERS:
        target.put_numbers(next_cell_, std::span(block.cell_numbers).subspan(first, end - first));
        break;
      default:
        if (auto status = append_values(block, first, end, filled); !status) return status;
        break;
    }
  }
  if (keep_blocks_)
    cell_blocks_.insert(cell_blocks_.end(),
                        block.cell_blocks.begin() + static_cast<std::ptrdiff_t>(first),
                        block.cell_blocks.begin() + static_cast<std::ptrdiff_t>(end));
  next_cell_ += end - first;
  next_corner_ += corners;
  return {};
}

Result<void> MeshPass::append_corners(const MeshBlock& block, std::size_t first, std::size_t end,
                                      Target& target) {
  std::uint64_t next = next_corner_;
  const auto corners =
      std::span(block.corners)
          .subspan(static_cast<std::size_t>(block.corner_begin[first]),
                   static_cast<std::size_t>(block.corner_begin[end] - block.corner_begin[first]));
  if (piece().whole && !corners.empty() &&
      *std::max_element(corners.begin(), corners.end()) < piece().vertex_count) {
    target.put_numbers(next, corners);
    return {};
  }
  for (const std::uint64_t corner : corners) {
    const auto place = position(piece().vertices, piece().whole, piece().vertex_count, corner);
    if (!place)
      return corrupt("a cell uses vertex " + std::to_string(corner) + ", which does not exist",
                     "mesh");
    target.put_number(next++, *place);
  }
  return {};
}

/// Appends the values of cells `first` to `end` - 1. Fails if the target has too few elements: its
/// size was computed from the cell counts in the index, and these may be wrong.
Result<void> MeshPass::append_values(const MeshBlock& block, std::size_t first, std::size_t end,
                                     Filled& filled) {
  Target& target = *filled.target;
  const std::byte* values = block.arrays[target.array()].data();
  // Each iteration handles a run of cells that either all have values or all have none.
  for (std::size_t c = first; c < end;) {
    const bool has = covers(filled, block.cell_blocks[c]);
    std::size_t run_end = c + 1;
    while (run_end < end && covers(filled, block.cell_blocks[run_end]) == has) ++run_end;
    const std::size_t count = run_end - c;
    if ((has || target.fills()) && count > target.elements() - filled.count)
      return corrupt("the index states fewer cells of a block than the file contains", "index");
    if (has) {
      target.put_values(filled.count, values + filled.taken * target.stride(), count);
      filled.taken += count;
    } else if (target.fills()) {
      target.put_nothing(filled.count, count);
    }
    filled.count += has || target.fills() ? count : 0;
    c = run_end;
  }
  return {};
}

/// Fills the targets for values of arrays with time steps.
class StepPass {
 public:
  /// All arguments are borrowed. `cell_blocks` contains the block index of each selected cell. It
  /// is used only for targets without SHMF_FILL whose cell array does not cover all blocks.
  StepPass(shmf_file& file, std::span<Target> targets,
           const std::vector<std::uint32_t>& cell_blocks);
  /// Returns the number of elements of all targets together.
  std::uint64_t elements() const;
  Result<void> run(Watch& watch, double done, double all);

 private:
  using Wanted = std::map<std::pair<std::uint32_t, std::uint64_t>, std::vector<Target*>>;

  Result<void> read(std::uint32_t array, std::uint64_t step, std::span<Target*> targets);
  Result<void> place(const shm::StepValues& values, std::span<Target*> targets);
  Result<std::uint64_t> place_of(const Target& target, std::uint64_t number) const;

  shmf_file* file_;
  const std::vector<std::uint32_t>* cell_blocks_;
  // targets, sorted by array and time step: reading the steps of an array in ascending order is
  // fastest
  Wanted wanted_;
  // indices of the selected cells that have values in the current array
  std::vector<std::uint64_t> covered_;
  std::uint64_t placed_ = 0;
};

StepPass::StepPass(shmf_file& file, std::span<Target> targets,
                   const std::vector<std::uint32_t>& cell_blocks)
    : file_(&file), cell_blocks_(&cell_blocks) {
  for (Target& target : targets)
    if (target.wanted() && target.is_stepped())
      wanted_[{target.array(), target.step()}].push_back(&target);
}

std::uint64_t StepPass::elements() const {
  std::uint64_t sum = 0;
  for (const auto& [key, targets] : wanted_) sum += targets.front()->elements();
  return sum;
}

Result<void> StepPass::run(Watch& watch, double done, double all) {
  for (auto& [key, targets] : wanted_) {
    if (auto status = read(key.first, key.second, targets); !status) return status;
    done += static_cast<double>(targets.front()->elements());
    if (auto status = watch.tell(done, all); !status) return status;
  }
  return {};
}

Result<void> StepPass::read(std::uint32_t array, std::uint64_t step, std::span<Target*> targets) {
  const Piece& piece = file_->piece;
  covered_.clear();
  if (file_->schema().arrays[array].location == shm::Location::cell)
    for (std::size_t c = 0; c < cell_blocks_->size(); ++c)
      if (file_->schema().array_covers(array, (*cell_blocks_)[c])) covered_.push_back(c);
  for (Target* target : targets) target->put_nothing(0, target->elements());

  shm::StepReader* reader = nullptr;
  if (piece.whole) {
    const auto opened = file_->mesh->step_reader();
    if (!opened) return opened.error();
    reader = *opened;
  }
  auto status = reader != nullptr ? reader->begin({array, step, std::nullopt, true})
                                  : file_->mesh->begin_values(array, step);
  if (!status) return status;
  placed_ = 0;
  while (true) {
    const auto values = reader != nullptr ? reader->next() : file_->mesh->next_values();
    if (!values) return values.error();
    if (*values == nullptr) break;
    if (auto placed = place(**values, targets); !placed) return placed;
  }
  const std::uint64_t expected =
      elements_of(file_->schema(), array, piece.vertex_count, piece.block_cells);
  if (placed_ < expected && !file_->damaged)
    return corrupt("there are values of " + std::to_string(placed_) + " elements, expected " +
                       std::to_string(expected),
                   "step values");
  return {};
}

Result<void> StepPass::place(const shm::StepValues& values, std::span<Target*> targets) {
  const std::size_t count = values.numbers.size();
  for (Target* target : targets) {
    for (std::size_t i = 0; i < count;) {  // for each run of consecutive positions
      const auto first = place_of(*target, values.numbers[i]);
      if (!first) return first.error();
      std::size_t end = i + 1;
      while (end < count && values.numbers[end] == values.numbers[i] + (end - i)) {
        const auto next = place_of(*target, values.numbers[end]);
        if (!next) return next.error();
        if (*next != *first + (end - i)) break;
        ++end;
      }
      target->put_values(*first, values.values.data() + i * target->stride(), end - i);
      i = end;
    }
  }
  placed_ += count;
  return {};
}

Result<std::uint64_t> StepPass::place_of(const Target& target, std::uint64_t number) const {
  const Piece& piece = file_->piece;
  const shm::Location location = target.info()->location;
  if (!is_on_mesh(location) && number < target.elements()) return number;
  const bool of_points = location == shm::Location::point;
  auto place = of_points ? position(piece.vertices, piece.whole, piece.vertex_count, number)
                         : position(piece.numbers, piece.whole, piece.cell_count, number);
  if (place && !of_points && !target.fills()) {
    const auto found = std::lower_bound(covered_.begin(), covered_.end(), *place);
    place = found != covered_.end() && *found == *place
                ? std::optional(static_cast<std::uint64_t>(found - covered_.begin()))
                : std::nullopt;
  }
  if (!place || *place >= target.elements())
    return corrupt(
        "there is a value of element " + std::to_string(number) + ", which does not exist",
        "step values");
  return *place;
}

Result<void> read_targets(shmf_file& file, std::span<Target> targets, const shmf_run_options& run) {
  // The mesh must be read in three cases: a target needs the mesh or a static array; a target needs
  // step values of only some of the vertices or cells; or the block of each cell must be known to
  // place the values of a cell array.
  bool mesh = false, stepped = false, stepped_points = false, blocks = false;
  for (const Target& target : targets) {
    if (!target.wanted()) continue;
    stepped = stepped || target.is_stepped();
    stepped_points = stepped_points || (target.is_stepped() && target.of_points());
    blocks = blocks || (target.is_stepped() && target.of_cells() && !target.fills());
    mesh = mesh || !target.is_stepped();
  }
  mesh = mesh || blocks || (stepped && !file.piece.whole);
  // The values of a vertex at a time step are stored in the segment that owns the vertex (the first
  // segment that contains it). For a selection, the coordinates are read to find the owners of the
  // vertices.
  MeshPass mesh_pass(file, targets, stepped_points && !file.piece.whole, blocks);
  StepPass step_pass(file, targets, mesh_pass.cell_blocks());
  const double in_mesh =
      mesh ? static_cast<double>(file.piece.vertex_count + file.piece.cell_count) : 0;
  const double all = in_mesh + static_cast<double>(step_pass.elements());
  Watch watch(run);
  if (mesh)
    if (auto status = mesh_pass.run(watch, all, read_options(run)); !status) return status;
  if (auto status = step_pass.run(watch, in_mesh, all); !status) return status;
  return watch.tell(1, 1);
}

/// A sequential source that counts the bytes that have been read.
class CountingSource final : public shm::ByteSource {
 public:
  explicit CountingSource(shm::RandomSource& source) : section_(source, 0, source.size()) {}
  Result<std::size_t> read(std::span<std::byte> into) override {
    auto count = section_.read(into);
    if (count) read_ += *count;
    return count;
  }
  std::uint64_t done() const { return read_; }

 private:
  shm::SectionSource section_;
  std::uint64_t read_ = 0;
};

Result<shm::CellSelection> selection_of(const shmf_selection* selection) {
  shm::CellSelection cells;
  if (selection == nullptr) return cells;
  const auto own = taken(selection, "the selection");
  if (!own) return own.error();
  if (own->first_cell != 0 || own->end_cell != 0) cells.range = {own->first_cell, own->end_cell};
  if (own->blocks == nullptr && own->block_count > 0) return misuse("the blocks are NULL");
  if (own->blocks != nullptr) cells.blocks.emplace(own->blocks, own->blocks + own->block_count);
  if (own->numbers == nullptr && own->number_count > 0) return misuse("the numbers are NULL");
  if (own->numbers != nullptr)
    cells.numbers.emplace(own->numbers, own->numbers + own->number_count);
  if (own->has_box != 0) {
    cells.box.emplace();
    std::copy(std::begin(own->box), std::end(own->box), cells.box->begin());
  }
  return cells;
}

/// Counts the elements of the selected piece by decoding its cells. Called if the index does not
/// contain these counts, or if they may be wrong.
Result<void> count_by_decoding(shmf_file& file, const shmf_run_options& run) {
  Piece& piece = file.piece;
  shm::ExtractRequest request;
  request.cells = piece.cells;
  request.arrays.emplace();
  request.coordinates = false;
  if (auto status = file.mesh->begin(request, read_options(run)); !status) return status;
  Watch watch(run);
  piece.vertex_count = piece.cell_count = piece.corner_count = 0;
  piece.block_cells.assign(file.schema().blocks.size(), 0);
  while (true) {
    const auto part = file.mesh->next();
    if (!part) return part.error();
    if (*part == nullptr) break;
    piece.corner_count += (*part)->corners.size();
    for (const std::uint32_t b : (*part)->cell_blocks) ++piece.block_cells[b];
    piece.vertex_count += (*part)->vertex_count();
    piece.cell_count += (*part)->cell_count();
    const auto status =
        watch.tell(static_cast<double>(piece.cell_count), static_cast<double>(file.mesh->cells()));
    if (!status) return status;
  }
  if (piece.whole) return {};
  piece.vertices = file.mesh->vertex_numbers();
  piece.numbers = file.mesh->cell_numbers();
  return {};
}

}  // namespace
}  // namespace shmf

shm::Result<void> shmf_file::count_piece(const shmf_run_options& run) {
  if (piece.counted) return {};
  const auto& blocks = schema().blocks;
  const bool varies = std::any_of(blocks.begin(), blocks.end(),
                                  [](const auto& block) { return block.nodes_per_cell == 0; });
  if (!piece.whole || varies) {
    if (auto status = shmf::count_by_decoding(*this, run); !status) return status;
  } else {
    piece.vertex_count = mesh->vertices();
    piece.cell_count = mesh->cells();
    piece.block_cells = mesh->block_cells();
    piece.block_cells.resize(blocks.size());
    piece.corner_count = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      std::uint64_t corners = 0;
      if (__builtin_mul_overflow(piece.block_cells[b], std::uint64_t{blocks[b].nodes_per_cell},
                                 &corners) ||
          __builtin_add_overflow(piece.corner_count, corners, &piece.corner_count))
        return shmf::corrupt("the index states more cells than a mesh can have", "index");
    }
  }
  piece.counted = true;
  return {};
}

using shm::Result;
using shmf::with_mesh;

shmf_status shmf_select(shmf_file* file, const shmf_selection* selection,
                        const shmf_run_options* run, shmf_counts* counts, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    auto cells = shmf::selection_of(selection);
    if (!cells) return cells.error();
    const auto watched = shmf::taken_or_default(run, "run");
    if (!watched) return watched.error();
    shmf::Piece piece;
    piece.cells = std::move(*cells);
    piece.whole = piece.cells.all() && !file->damaged;
    // Restores the previous selection if the new selection cannot be counted or memory runs out.
    struct Restoring {
      shmf::Piece& of;
      shmf::Piece old;
      bool counted = false;
      ~Restoring() {
        if (!counted) std::swap(of, old);
      }
    } restoring{file->piece, std::move(piece)};
    std::swap(file->piece, restoring.old);
    if (auto status = file->count_piece(*watched); !status) return status;
    restoring.counted = true;
    if (counts == nullptr) return {};
    shmf_counts own{};
    own.vertices = file->piece.vertex_count;
    own.cells = file->piece.cell_count;
    own.corners = file->piece.corner_count;
    return shmf::give(counts, own, "counts");
  });
}

shmf_status shmf_read(shmf_file* file, shmf_target* targets, size_t count,
                      const shmf_run_options* run, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (targets == nullptr && count > 0) return shmf::misuse("the targets are NULL");
    const auto watched = shmf::taken_or_default(run, "run");
    if (!watched) return watched.error();
    if (auto status = file->count_piece(shmf_run_options{}); !status) return status;
    std::vector<shmf::Target> own;
    // the first error; returned only after the loop, so that `used` is set for all targets
    std::optional<shm::Error> first;
    for (std::size_t i = 0; i < count; ++i) {
      auto target = shmf::Target::of(*shmf::at(targets, i), i, *file);
      if (target)
        own.push_back(*target);
      else if (!first)
        first = target.error();
    }
    if (first) return *first;
    return shmf::read_targets(*file, own, *watched);
  });
}

shmf_status shmf_verify(shmf_file* file, const shmf_run_options* run, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (file->damaged) return shmf::misuse("a file opened as damaged cannot be verified");
    const auto watched = shmf::taken_or_default(run, "run");
    if (!watched) return watched.error();
    shmf::Watch watch(*watched);
    const shm::ByteRange all{0, file->bytes().size()};
    file->bytes().prefetch({&all, 1});
    shmf::CountingSource source(file->bytes());
    shm::ReadOptions options = shmf::read_options(*watched);
    if (const auto bytes = shm::bytes_of_file(file->bytes())) options.file_bytes = *bytes;
    auto reader = shm::Reader::open(source, file->limits, options);
    if (!reader) return reader.error();
    while (true) {
      const auto item = reader->next();
      if (!item) return item.error();
      const auto size = static_cast<double>(file->bytes().size());
      const auto done = *item == nullptr ? size : static_cast<double>(source.done());
      if (auto status = watch.tell(done, size); !status) return status;
      if (*item == nullptr) return {};
    }
  });
}
