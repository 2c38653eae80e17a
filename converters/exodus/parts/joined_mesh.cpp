#include "exodus/parts/joined_mesh.h"

#include <algorithm>
#include <cstring>
#include <tuple>

#include "exodus/parts/messages.h"

namespace shm::converters {
namespace {

constexpr std::size_t kPieceCells = 4096, kPieceBytes = std::size_t{1} << 20;

std::uint64_t elements_in(std::size_t stride) {
  return std::max<std::uint64_t>(1, kPieceBytes / std::max<std::size_t>(stride, 1));
}

// The number of an element, and the part that sent the value of this element. Used in error
// messages.
struct Element {
  std::uint64_t number = 0, part = 0;
};

void append(std::vector<std::byte>& out, const void* from, std::size_t size) {
  const auto* begin = static_cast<const std::byte*>(from);
  out.insert(out.end(), begin, begin + size);
}

// Identifies an array by the name of its variable, its plane and its first column (see
// ArrayLayout).
using Column = std::tuple<std::string, std::uint64_t, std::uint32_t>;
Column column_of(const exodus::Skeleton& skeleton, const exodus::ArrayLayout& array,
                 const exodus::ArrayPart& part) {
  return {skeleton.variables[static_cast<std::size_t>(part.variable)].name, array.plane,
          array.column};
}

}  // namespace

JoinedMesh::JoinedMesh(Ranks& ranks, const std::vector<std::string>& files, Spool& spool)
    : ranks_(&ranks), spool_(&spool), parts_(ranks, files), cells_(spool) {
  parts_.find_numbers();
  structure_ = join_structure(parts_);
  owners_.emplace(ranks, info().vertices);
  ranks.together([&] {
    std::uint64_t sum = 0;
    for (const std::uint64_t cells : info().block_cells) {
      block_begins_.push_back(sum);
      sum += cells;
    }
    map_arrays();
  });
}

// --- positions of arrays in the parts

void JoinedMesh::map_arrays() {
  for (const PartFile& part : parts_.mine()) {
    std::vector<std::vector<Piece>>& pieces = pieces_.emplace_back();
    const exodus::Layout& layout = part.mesh->layout();
    std::vector<std::uint64_t> begins;
    std::uint64_t sum = 0;
    for (const exodus::BlockLayout& block : layout.blocks) {
      begins.push_back(sum);
      sum += block.cells;
    }
    std::map<Column, Piece> known;
    for (std::size_t a = 0; a < layout.arrays.size(); ++a) {
      std::uint64_t first = 0;
      for (const exodus::ArrayPart& one : layout.arrays[a].parts) {
        if (!is_on_mesh(layout.arrays[a].info.location)) break;
        const bool all = one.block == exodus::ArrayPart::kEverything;
        const std::uint64_t count = exodus::elements_of(layout, layout.arrays[a], one);
        if (one.variable >= 0)
          known.emplace(column_of(part.mesh->skeleton(), layout.arrays[a], one),
                        Piece{a, first, all ? 0 : begins[one.block], count});
        first += count;
      }
    }
    const exodus::Layout& whole = structure_.layout;
    for (const exodus::ArrayLayout& array : whole.arrays) {
      pieces.emplace_back();
      for (const exodus::ArrayPart& one : array.parts) {
        if (!is_on_mesh(array.info.location)) break;
        const bool all = one.block == exodus::ArrayPart::kEverything;
        const std::uint64_t needed = !all ? layout.blocks[one.block].cells
                                     : array.info.location == Location::point ? layout.vertices
                                                                              : layout.cells;
        if (needed == 0) continue;
        const Column column = column_of(structure_.skeleton, array, one);
        const auto found = known.find(column);
        if (found == known.end() || found->second.count != needed)
          throw Failure(Error{.code = ErrorCode::corrupt,
                              .detail = "is missing here, but other parts have it",
                              .section = "variable '" + std::get<0>(column) + "'",
                              .file = part.file});
        pieces.back().push_back(found->second);
      }
    }
  }
}

std::size_t JoinedMesh::stride_of(std::size_t array) const {
  return array == kCoordinates ? 3 * scalar_bytes(info().schema.coordinate_type)
                               : info().array_stride(array);
}

Location JoinedMesh::location_of(std::size_t array) const {
  return array == kCoordinates ? Location::point : info().schema.arrays[array].location;
}

// Returns the number of elements of a cell array that belong to cells with numbers below `cell`.
std::uint64_t JoinedMesh::covered_before(std::size_t array, std::uint64_t cell) const {
  std::uint64_t sum = 0;
  for (std::uint32_t b = 0; b < block_begins_.size() && block_begins_[b] < cell; ++b)
    if (info().schema.array_covers(array, b))
      sum += std::min(cell - block_begins_[b], info().block_cells[b]);
  return sum;
}

std::size_t JoinedMesh::rank_with(std::uint64_t cell) const {
  return static_cast<std::size_t>(std::upper_bound(ends_.begin(), ends_.end(), cell) -
                                  ends_.begin());
}

// --- cells

void JoinedMesh::hold_cells(const CellRange& range) {
  range_ = range;
  for (std::size_t r = 0; r < ranks_->size(); ++r) ends_.push_back(ranks_->broadcast(range.end, r));
  ranks_->together([&] { arrival_.emplace(*spool_, range.end - range.first); });

  std::size_t part = 0;
  std::uint64_t cell = 0;  // index of the cell in its part
  CellBatch batch;
  const auto fill = [&](std::vector<std::vector<std::byte>>& to) {
    auto& mine = parts_.mine();
    while (part < mine.size() && cell == mine[part].cells.size()) {
      ++part;
      cell = 0;
    }
    if (part == mine.size()) return false;
    if (!mine[part].mesh->next_cells(batch, kPieceCells))
      throw Failure(ErrorCode::corrupt, "has fewer elements than its header states",
                    mine[part].file);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::uint64_t place = mine[part].cells[cell + i], count = batch.cell(i).size();
      std::vector<std::byte>& out = to[rank_with(place)];
      append(out, &place, sizeof place);
      append(out, &count, sizeof count);
      for (const std::uint64_t corner : batch.cell(i))
        append(out, &mine[part].vertices[corner], sizeof corner);
    }
    cell += batch.size();
    return true;
  };
  std::vector<std::uint64_t> corners;
  in_rounds(*ranks_, fill, [&](std::span<const std::byte> bytes) {
    for (Unpacker in(bytes); !in.empty();) {
      const auto place = in.get<std::uint64_t>();
      corners.resize(in.get<std::uint64_t>());
      for (std::uint64_t& corner : corners) corner = in.get<std::uint64_t>();
      arrival_->set(place - range_.first, cells_.size());
      const auto block = std::upper_bound(block_begins_.begin(), block_begins_.end(), place) -
                         block_begins_.begin() - 1;
      cells_.append(static_cast<std::uint32_t>(block), corners);
    }
  });
}

// Appends the cells `first` to `first` + `count` - 1, which this rank must hold, to `out`. Cells
// that arrived consecutively are read in one call.
void JoinedMesh::read_held(std::uint64_t first, std::uint64_t count, CellBatch& out) {
  for (std::uint64_t cell = first, end = first + count; cell < end;) {
    const std::uint64_t place = arrival_->get(cell - range_.first);
    std::uint64_t run = 1;
    while (cell + run < end && arrival_->get(cell + run - range_.first) == place + run) ++run;
    cells_.read_run(place, run, out);
    cell += run;
  }
}

bool JoinedMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t all = info().cells();
  if (next_cell_ >= all || max_cells == 0) return false;
  if (!alone_) {
    ranks_->uninterrupted([&] { serve_cells(out, max_cells); });
  } else {
    if (next_cell_ < range_.first || next_cell_ >= range_.end) return false;
    read_held(next_cell_, std::min<std::uint64_t>(max_cells, range_.end - next_cell_), out);
  }
  next_cell_ += out.size();
  return true;
}

void JoinedMesh::serve_cells(CellBatch& out, std::size_t max_cells) {
  const std::size_t holder = rank_with(next_cell_);
  const std::uint64_t count =
      std::min<std::uint64_t>({max_cells, kPieceCells, ends_[holder] - next_cell_});
  Packer message;
  ranks_->together([&] {
    if (ranks_->rank() != holder) return;
    CellBatch batch;
    batch.clear();
    read_held(next_cell_, count, batch);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      message.put(batch.blocks[i]);
      message.put_bytes(std::as_bytes(batch.cell(i)));
    }
  });
  message.bytes = ranks_->broadcast(std::move(message.bytes), holder);
  for (Unpacker in(message.bytes); !in.empty();) {
    out.blocks.push_back(in.get<std::uint32_t>());
    for (Unpacker corners(in.get_bytes()); !corners.empty();)
      out.corners.push_back(corners.get<std::uint64_t>());
    out.corner_begin.push_back(out.corners.size());
  }
}

// --- values

auto JoinedMesh::load(std::size_t array, std::uint64_t step) -> Kept {
  return location_of(array) == Location::point ? load_vertices(array, step)
                                               : load_cells(array, step);
}

// Sends the values of vertices to the owners of these vertices. Throws SharedFailure if two parts
// have different values for the same vertex.
auto JoinedMesh::load_vertices(std::size_t array, std::uint64_t step) -> Kept {
  const std::size_t stride = stride_of(array);
  Kept out{owners_->first(), PagedArray(*spool_, stride)};
  std::vector<bool> seen;
  ranks_->together([&] { seen.resize(owners_->count()); });
  std::size_t part = 0;
  std::uint64_t position = 0;
  std::vector<std::byte> values;
  const auto fill = [&](std::vector<std::vector<std::byte>>& to) {
    auto& mine = parts_.mine();
    while (part < mine.size() && position == mine[part].vertices.size()) {
      ++part;
      position = 0;
    }
    if (part == mine.size()) return false;
    PartFile& file = mine[part];
    const std::uint64_t count =
        std::min<std::uint64_t>(elements_in(stride), file.vertices.size() - position);
    values.resize(count * stride);
    if (array == kCoordinates)
      file.mesh->read_points(position, count, values.data());
    else
      file.mesh->read_array(pieces_[part][array].front().array, step, position, count,
                            values.data());
    for (std::uint64_t i = 0; i < count; ++i) {
      const Element element{file.vertices[position + i], file.part};
      std::vector<std::byte>& out_bytes = to[owners_->owner(element.number)];
      append(out_bytes, &element, sizeof element);
      append(out_bytes, values.data() + i * stride, stride);
    }
    position += count;
    return true;
  };
  std::vector<std::byte> known(stride);
  in_rounds(*ranks_, fill, [&](std::span<const std::byte> bytes) {
    for (Unpacker in(bytes); !in.empty();) {
      const auto element = in.get<Element>();
      const auto value = in.take(stride);
      const std::uint64_t place = element.number - out.first;
      if (!seen[place]) {
        out.values.write(place, 1, value.data());
        seen[place] = true;
        continue;
      }
      out.values.read(place, 1, known.data());
      if (std::equal(known.begin(), known.end(), value.begin(), value.end())) continue;
      const std::string what = array == kCoordinates
                                   ? "coordinates"
                                   : "array '" + info().schema.arrays[array].name + "'";
      throw Failure(Error{.code = ErrorCode::corrupt,
                          .detail = "node " + std::to_string(element.number + parts_.first_node()) +
                                    " of the mesh has values that differ from another part" +
                                    (array != kCoordinates && info().schema.arrays[array].per_step
                                         ? ", at step " + std::to_string(step)
                                         : std::string()),
                          .section = what,
                          .file = parts_.names()[element.part]});
    }
  });
  return out;
}

// Sends the values of an array on the cells of this rank's parts to the ranks that hold these
// cells.
auto JoinedMesh::load_cells(std::size_t array, std::uint64_t step) -> Kept {
  const std::size_t stride = stride_of(array);
  Kept out{covered_before(array, range_.first), PagedArray(*spool_, stride)};
  // For each block, the difference between the index of an element in the array and the number of
  // its cell. This is the number of elements minus the number of cells in all earlier blocks.
  std::vector<std::uint64_t> shift;
  std::uint64_t covered = 0;
  for (std::uint32_t b = 0; b < block_begins_.size(); ++b) {
    shift.push_back(covered - block_begins_[b]);
    if (info().schema.array_covers(array, b)) covered += info().block_cells[b];
  }
  std::size_t part = 0, piece = 0;
  std::uint64_t position = 0;
  std::vector<std::byte> values;
  const auto fill = [&](std::vector<std::vector<std::byte>>& to) {
    auto& mine = parts_.mine();
    for (; part < mine.size(); ++part, piece = 0) {
      const auto& pieces = pieces_[part][array];
      if (piece < pieces.size() && position == pieces[piece].count) {
        ++piece;
        position = 0;
      }
      if (piece < pieces.size()) break;
    }
    if (part == mine.size()) return false;
    const Piece& from = pieces_[part][array][piece];
    const std::uint64_t count = std::min<std::uint64_t>(elements_in(stride), from.count - position);
    values.resize(count * stride);
    mine[part].mesh->read_array(from.array, step, from.first + position, count, values.data());
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t cell = mine[part].cells[from.cell + position + i];
      std::vector<std::byte>& out_bytes = to[rank_with(cell)];
      append(out_bytes, &cell, sizeof cell);
      append(out_bytes, values.data() + i * stride, stride);
    }
    position += count;
    return true;
  };
  in_rounds(*ranks_, fill, [&](std::span<const std::byte> bytes) {
    for (Unpacker in(bytes); !in.empty();) {
      const auto cell = in.get<std::uint64_t>();
      const auto block = std::upper_bound(block_begins_.begin(), block_begins_.end(), cell) -
                         block_begins_.begin() - 1;
      out.values.write(cell + shift[static_cast<std::size_t>(block)] - out.first, 1,
                       in.take(stride).data());
    }
  });
  return out;
}

// Fetches the values of the vertices in vertices_ from their owners. Returns the values in the
// order of vertices_.
PagedArray JoinedMesh::fetch(Kept& kept, std::size_t array) {
  const std::size_t stride = stride_of(array);
  PagedArray taken(*spool_, stride);
  const std::uint64_t batch = std::max<std::uint64_t>(elements_in(stride) / ranks_->size(), 16);
  const std::uint64_t rounds = ranks_->largest((vertices_.size() + batch - 1) / batch);
  std::optional<Error> error;
  for (std::uint64_t round = 0; round < rounds; ++round) {
    // The numbers in vertices_ ascend, and each rank owns higher numbers than the previous rank.
    // The answers, sorted by rank, are therefore in the order of vertices_.
    std::vector<std::vector<std::uint64_t>> ask(ranks_->size());
    const std::uint64_t begin = std::min<std::uint64_t>(round * batch, vertices_.size());
    const std::uint64_t end = std::min<std::uint64_t>(begin + batch, vertices_.size());
    for (std::uint64_t i = begin; i < end; ++i)
      ask[owners_->owner(vertices_[i])].push_back(vertices_[i]);
    const auto asked = ranks_->exchange(ask);
    std::vector<std::vector<std::byte>> answers(ranks_->size());
    attempt(error, [&] {
      for (std::size_t r = 0; r < asked.size(); ++r) {
        answers[r].resize(asked[r].size() * stride);
        for (std::size_t i = 0; i < asked[r].size(); ++i)
          kept.values.read(asked[r][i] - kept.first, 1, answers[r].data() + i * stride);
      }
    });
    ranks_->agree(error);
    const auto got = ranks_->exchange(answers);
    attempt(error, [&] {
      for (const auto& bytes : got)
        if (!bytes.empty()) taken.append(bytes.size() / stride, bytes.data());
    });
  }
  ranks_->agree(error);
  return taken;
}

auto JoinedMesh::kept(std::size_t array, std::uint64_t step) -> Kept& {
  if (array == kCoordinates || !info().schema.arrays[array].per_step) {
    auto found = static_.find(array);
    if (found == static_.end()) found = static_.emplace(array, load(array, 0)).first;
    return found->second;
  }
  if (step_ != std::pair(array, step)) {
    step_values_.reset();
    step_values_.emplace(load(array, step));
    step_ = std::pair(array, step);
  }
  return *step_values_;
}

// --- collective reading

// Collective. Copies the values of elements from the ranks that hold them to all ranks.
void JoinedMesh::serve(std::size_t array, std::uint64_t step, std::uint64_t first,
                       std::uint64_t count, std::byte* out) {
  Kept& values = kept(array, step);
  const bool of_points = location_of(array) == Location::point;
  const std::size_t stride = stride_of(array);
  for (std::size_t r = 0; r < ranks_->size() && count > 0; ++r) {
    const std::uint64_t end = of_points ? owners_->end_of(r) : covered_before(array, ends_[r]);
    if (first >= end) continue;
    const std::uint64_t run = std::min(count, end - first);
    std::vector<std::byte> bytes;
    ranks_->together([&] {
      if (ranks_->rank() != r) return;
      bytes.resize(run * stride);
      values.values.read(first - values.first, run, bytes.data());
    });
    bytes = ranks_->broadcast(std::move(bytes), r);
    std::copy(bytes.begin(), bytes.end(), out);
    out += run * stride;
    first += run;
    count -= run;
  }
}

void JoinedMesh::hold_vertices(const std::vector<std::uint64_t>& vertices) {
  ranks_->together([&] {
    vertices_ = vertices;
    std::sort(vertices_.begin(), vertices_.end());
  });
  std::vector<std::size_t> arrays{kCoordinates};
  for (std::size_t a = 0; a < info().schema.arrays.size(); ++a)
    if (!info().schema.arrays[a].per_step) arrays.push_back(a);
  for (const std::size_t array : arrays) {
    Kept& values = kept(array, 0);
    if (location_of(array) != Location::point) continue;
    taken_.emplace(array, fetch(values, array));
    static_.erase(array);
  }
  step_.reset();
  step_values_.reset();
}

void JoinedMesh::hold_step(std::size_t array, std::uint64_t step) {
  if (!is_on_mesh(location_of(array))) return;
  step_taken_.reset();
  Kept& values = kept(array, step);
  if (location_of(array) != Location::point) return;
  step_taken_.emplace(fetch(values, array));
  step_values_.reset();
}

// Reads the values of `count` vertices. The value of a vertex that was not fetched is 0.
void JoinedMesh::read_vertices(PagedArray& values, std::size_t stride, std::uint64_t first,
                               std::uint64_t count, std::byte* out) const {
  std::memset(out, 0, count * stride);
  auto begin = std::lower_bound(vertices_.begin(), vertices_.end(), first);
  while (begin != vertices_.end() && *begin < first + count) {
    auto end = begin + 1;
    while (end != vertices_.end() && *end == *(end - 1) + 1 && *end < first + count) ++end;
    values.read(static_cast<std::uint64_t>(begin - vertices_.begin()),
                static_cast<std::uint64_t>(end - begin), out + (*begin - first) * stride);
    begin = end;
  }
}

void JoinedMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  if (!alone_)
    ranks_->uninterrupted([&] { serve(kCoordinates, 0, first, count, out); });
  else
    read_vertices(taken_.at(kCoordinates), stride_of(kCoordinates), first, count, out);
}

// Reads values of an array that is neither on points nor on cells. All ranks have all of them.
void JoinedMesh::read_beside_mesh(std::size_t array, std::uint64_t step, std::uint64_t first,
                                  std::uint64_t count, std::byte* out) const {
  const exodus::ArrayLayout& layout = structure_.layout.arrays[array];
  const std::size_t stride = info().array_stride(array);
  for (const exodus::ArrayPart& part : layout.parts) {
    if (first >= part.elements) {
      first -= part.elements;
      continue;
    }
    const std::vector<std::byte>& values = structure_.beside_mesh.at(part.variable);
    const std::uint64_t run = std::min(count, part.elements - first);
    const std::size_t row = values.size() / structure_.layout.steps;
    std::copy_n(values.data() + step * row + (layout.plane + first) * stride, run * stride, out);
    out += run * stride;
    count -= run;
    first = 0;
  }
}

void JoinedMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                            std::uint64_t count, std::byte* out) {
  if (!is_on_mesh(location_of(array))) return read_beside_mesh(array, step, first, count, out);
  if (!alone_) {
    ranks_->uninterrupted([&] { serve(array, step, first, count, out); });
    return;
  }
  const bool stepped = info().schema.arrays[array].per_step;
  if (location_of(array) == Location::point) {
    read_vertices(stepped ? step_taken_.value() : taken_.at(array), stride_of(array), first, count,
                  out);
    return;
  }
  Kept& values = stepped ? step_values_.value() : static_.at(array);
  // Callers read whole pages, which may contain elements that this rank does not hold. The values
  // of these elements are 0.
  std::memset(out, 0, count * stride_of(array));
  const std::uint64_t begin = std::max(first, values.first);
  const std::uint64_t end = std::min(first + count, values.first + values.values.size());
  if (begin < end)
    values.values.read(begin - values.first, end - begin, out + (begin - first) * stride_of(array));
}

}  // namespace shm::converters
