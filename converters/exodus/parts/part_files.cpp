#include "exodus/parts/part_files.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>
#include <utility>

#include "exodus/parts/messages.h"
#include "exodus/parts/owners.h"

namespace shm::converters {
namespace {

constexpr std::size_t kMostParts = 1 << 20;

[[noreturn]] void fail(const PartFile& part, const std::string& section,
                       const std::string& detail) {
  throw Failure(
      Error{.code = ErrorCode::corrupt, .detail = detail, .section = section, .file = part.file});
}

// Reads the global number (the number in the whole mesh) of each node or element of a part from the
// variable `map`. Throws Failure unless there are `count` distinct numbers.
std::vector<std::uint64_t> numbers_in(const PartFile& part, const char* map, std::uint64_t count) {
  if (count == 0) return {};
  const std::string section = std::string("variable '") + map + "'";
  const exodus::Skeleton& skeleton = part.mesh->skeleton();
  const int index = skeleton.find_variable(map);
  if (index < 0)
    fail(part, section,
         "is missing; without it, the global numbers of the part's nodes or elements are unknown");
  const exodus::Variable& variable = skeleton.variables[static_cast<std::size_t>(index)];
  if (!exodus::is_integer(variable.type) ||
      skeleton.shape(variable) != std::vector<std::uint64_t>{count})
    fail(part, section, "is not a list of " + std::to_string(count) + " integers");
  std::vector<std::uint64_t> numbers;
  numbers.reserve(count);
  for (const std::int64_t number : part.mesh->integers(index, 0, count)) {
    if (number < 0) fail(part, section, "has number " + std::to_string(number));
    numbers.push_back(static_cast<std::uint64_t>(number));
  }
  std::vector<std::uint64_t> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) fail(part, section, "has number " + std::to_string(*twice) + " twice");
  return numbers;
}

// The range of node or element numbers in the part files. Numbers normally start at 1, but some
// programs start at 0.
struct NumberRange {
  std::uint64_t base = 1, end = 0;
};
NumberRange range_of(Ranks& ranks, const std::vector<PartFile>& parts,
                     std::vector<std::uint64_t> PartFile::*numbers) {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), last = 0;
  for (const PartFile& part : parts)
    for (const std::uint64_t number : part.*numbers) {
      first = std::min(first, number);
      last = std::max(last, number);
    }
  NumberRange range;
  range.base = ranks.smallest(first) == 0 ? 0 : 1;
  range.end = ranks.largest(last) + 1;
  return range;
}

// Throws Failure unless all numbers of all parts are in the range from `base` to `base` + `count`
// - 1.
void check_range(const std::vector<PartFile>& parts, const char* map, std::uint64_t base,
                 std::uint64_t count, std::vector<std::uint64_t> PartFile::*numbers) {
  for (const PartFile& part : parts)
    for (const std::uint64_t number : part.*numbers)
      if (number - base >= count)
        fail(part, std::string("variable '") + map + "'",
             "has number " + std::to_string(number) + ", but there are " + std::to_string(count) +
                 " in all parts");
}

}  // namespace

std::string part_name(const std::string& whole, std::size_t parts, std::size_t part) {
  const std::string count = std::to_string(parts), number = std::to_string(part);
  return whole + '.' + count + '.' + std::string(count.size() - number.size(), '0') + number;
}

std::size_t count_of_parts(const std::string& name) {
  std::error_code none;
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || std::filesystem::exists(name, none)) return 0;
  std::size_t count = 0;
  const char* end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data() + dot + 1, end, count);
  if (error != std::errc() || rest != end || count == 0 || count > kMostParts ||
      name[dot + 1] == '0')
    return 0;
  return std::filesystem::exists(part_name(name.substr(0, dot), count, 0), none) ? count : 0;
}

std::vector<std::string> part_files(const std::string& name, std::size_t count) {
  std::vector<std::string> files;
  for (std::size_t part = 0; part < count; ++part)
    files.push_back(part_name(name.substr(0, name.rfind('.')), count, part));
  return files;
}

PartFiles::PartFiles(Ranks& ranks, const std::vector<std::string>& files)
    : ranks_(&ranks), names_(files) {
  const std::size_t each = files.size() / ranks.size(), over = files.size() % ranks.size();
  const auto first = [&](std::size_t rank) { return each * rank + std::min(rank, over); };
  ranks.together([&] {
    for (std::size_t part = first(ranks.rank()); part < first(ranks.rank() + 1); ++part) {
      mine_.emplace_back();
      mine_.back().part = part;
      mine_.back().file = files[part];
      mine_.back().mesh = std::make_unique<exodus::ExodusMesh>(files[part]);
    }
  });
  count();
}

// Counts the cells of each block across all parts. All parts must have the same blocks, but a block
// may be empty in some parts.
void PartFiles::count() {
  const std::uint64_t blocks =
      ranks_->largest(mine_.empty() ? 0 : mine_.front().mesh->layout().blocks.size());
  std::vector<std::uint64_t> cells;
  ranks_->together([&] {
    cells.resize(blocks);
    for (const PartFile& part : mine_) {
      const auto& mine = part.mesh->layout().blocks;
      if (mine.size() != blocks)
        fail(part, "dimension 'num_el_blk'",
             "is " + std::to_string(mine.size()) + ", but " + std::to_string(blocks) +
                 " in another part");
      for (std::size_t b = 0; b < blocks; ++b) {
        if (mine[b].faces >= 0 || mine[b].shape == CellShape::polyhedron)
          throw Failure(Error{.code = ErrorCode::unsupported,
                              .detail = "polyhedra of parts cannot be joined",
                              .section = "element block " + std::to_string(b + 1),
                              .file = part.file});
        if (mine[b].cells > std::numeric_limits<std::uint64_t>::max() / kMostParts / 2)
          fail(part, "dimension 'num_el_in_blk" + std::to_string(b + 1) + "'",
               "there cannot be that many elements");
        cells[b] += mine[b].cells;
      }
    }
  });
  block_cells_ = ranks_->sums(cells).all;
}

void PartFiles::find_numbers() {
  find_vertices();
  find_cells();
}

void PartFiles::find_vertices() {
  std::uint64_t nodes = 0;
  ranks_->together([&] {
    for (PartFile& part : mine_) {
      part.vertices = numbers_in(part, "node_num_map", part.mesh->layout().vertices);
      nodes += part.vertices.size();
    }
  });
  const std::uint64_t all = ranks_->sums({nodes}).all[0];
  if (all == 0) return;
  const NumberRange range = range_of(*ranks_, mine_, &PartFile::vertices);
  // Each node of the mesh occurs in at least one part. The total number of nodes in the parts is
  // therefore an upper bound on the number of nodes in the mesh.
  const std::uint64_t most = std::min(all, range.end - range.base);
  ranks_->together(
      [&] { check_range(mine_, "node_num_map", range.base, all, &PartFile::vertices); });
  vertices_ = most;
  first_node_ = range.base;
  for (PartFile& part : mine_)
    for (std::uint64_t& number : part.vertices) number -= range.base;
  ranks_->together([&] {
    for (const PartFile& part : mine_) {
      const exodus::Skeleton& skeleton = part.mesh->skeleton();
      const std::uint64_t stated = skeleton.length_of("num_nodes_global");
      if (stated != 0 && stated != vertices_)
        fail(part, "dimension 'num_nodes_global'",
             "states " + std::to_string(stated) +
                 " nodes, but the highest node number in any part is " + std::to_string(vertices_));
    }
  });

  NumberOwners owners(*ranks_, vertices_);
  struct Had {
    std::uint64_t number = 0;
  };
  std::vector<bool> had;
  ranks_->together([&] { had.resize(owners.count()); });
  std::vector<Had> mine;
  ranks_->together([&] {
    mine.reserve(nodes);
    for (const PartFile& part : mine_)
      for (const std::uint64_t number : part.vertices) mine.push_back({number});
  });
  owners.send(mine, [&](const Had& item) { had[item.number - owners.first()] = true; });
  ranks_->together([&] {
    const auto missing = std::find(had.begin(), had.end(), false);
    if (missing == had.end()) return;
    const auto number = static_cast<std::uint64_t>(missing - had.begin()) + owners.first();
    throw Failure(Error{.code = ErrorCode::corrupt,
                        .detail = "node " + std::to_string(number + range.base) + " is in no part",
                        .section = "variable 'node_num_map'",
                        .file = names_.front()});
  });
}

// Finds the index of each part's cells in the whole mesh. In the whole mesh, cells are sorted by
// block, and within a block by their numbers in the files.
void PartFiles::find_cells() {
  struct CellPlace {
    std::uint64_t number = 0;
    std::uint32_t block = 0, part = 0;
  };
  constexpr std::uint32_t kNobody = ~std::uint32_t{0};
  std::uint64_t count = 0;
  for (const std::uint64_t cells : block_cells_)
    if (__builtin_add_overflow(count, cells, &count))
      count = std::numeric_limits<std::uint64_t>::max();
  ranks_->together([&] {
    for (PartFile& part : mine_)
      part.cells = numbers_in(part, "elem_num_map", part.mesh->layout().cells);
  });
  if (count == 0) return;
  const NumberRange range = range_of(*ranks_, mine_, &PartFile::cells);
  ranks_->together([&] {
    check_range(mine_, "elem_num_map", range.base, count, &PartFile::cells);
    for (PartFile& part : mine_)
      for (std::uint64_t& number : part.cells) number -= range.base;
  });

  NumberOwners owners(*ranks_, count);
  std::vector<CellPlace> mine, known;
  ranks_->together([&] {
    known.assign(owners.count(), CellPlace{0, kNobody, 0});
    for (const PartFile& part : mine_) {
      std::size_t cell = 0;
      const auto& blocks = part.mesh->layout().blocks;
      for (std::uint32_t b = 0; b < blocks.size(); ++b)
        for (std::uint64_t i = 0; i < blocks[b].cells; ++i)
          mine.push_back({part.cells[cell++], b, static_cast<std::uint32_t>(part.part)});
    }
  });
  std::optional<Error> error;
  owners.send(mine, [&](const CellPlace& item) {
    CellPlace& place = known[item.number - owners.first()];
    if (place.block != kNobody && !error)
      error = Error{.code = ErrorCode::corrupt,
                    .detail = "element " + std::to_string(item.number + range.base) +
                              " is also in " + names_[std::min(item.part, place.part)],
                    .section = "variable 'elem_num_map'",
                    .file = names_[std::max(item.part, place.part)]};
    place = item;
  });
  // Each number in the range occurs, because the size of the range is the number of elements,
  // and no number occurs twice.
  ranks_->agree(error);
  mine = {};

  std::vector<std::uint64_t> in_block;
  ranks_->together([&] {
    in_block.resize(block_cells_.size());
    for (const CellPlace& item : known) ++in_block[item.block];
  });
  std::vector<std::uint64_t> next = ranks_->sums(in_block).before;
  std::vector<std::uint64_t> places;
  ranks_->together([&] {
    std::uint64_t begin = 0;
    for (std::size_t b = 0; b < next.size(); begin += block_cells_[b++]) next[b] += begin;
    places.reserve(known.size());
    for (const CellPlace& item : known) places.push_back(next[item.block]++);
    known = {};
  });
  const std::size_t rounds = static_cast<std::size_t>(ranks_->largest(mine_.size()));
  const std::vector<std::uint64_t> none;
  for (std::size_t i = 0; i < rounds; ++i) {
    auto answers = owners.ask<std::uint64_t>(
        i < mine_.size() ? mine_[i].cells : none,
        [&](std::uint64_t number) { return places[number - owners.first()]; });
    if (i < mine_.size()) mine_[i].cells = std::move(answers);
  }
}

}  // namespace shm::converters
