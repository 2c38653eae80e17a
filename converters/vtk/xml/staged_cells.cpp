#include "vtk/xml/staged_cells.h"

#include <algorithm>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "vtk/words.h"

namespace shm::converters::vtu {
namespace {

constexpr std::uint64_t kPieceNumbers = 8192;

// Collects numbers and passes them on in pieces.
class Buffer {
 public:
  explicit Buffer(const StagedCells::Take& take) : take_(take) {}
  void add(std::int64_t number) {
    numbers_.push_back(number);
    if (numbers_.size() == kPieceNumbers) flush();
  }
  void flush() {
    if (!numbers_.empty()) take_(numbers_);
    numbers_.clear();
  }

 private:
  const StagedCells::Take& take_;
  std::vector<std::int64_t> numbers_;
};

// Finds the point list of a polyhedron by its cell number. Contains only the polyhedra whose points
// have an unusual order in the source file, and whose point lists are therefore stored as extras
// (see vtu.h).
class ReorderedPolyhedra {
 public:
  explicit ReorderedPolyhedra(const VtuPlan& plan)
      : points_(plan.integers("vtu/polyhedron/points")) {
    const auto cells = plan.integers("vtu/polyhedron/cells");
    const auto counts = plan.integers("vtu/polyhedron/counts");
    if (cells.size() != counts.size())
      vtk::fail_extra("vtu/polyhedron/counts", "the length differs from the number of polyhedra");
    std::size_t begin = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (counts[i] < 0 || static_cast<std::uint64_t>(counts[i]) > points_.size() - begin)
        vtk::fail_extra("vtu/polyhedron/counts",
                        "states more points than vtu/polyhedron/points contains");
      const auto size = static_cast<std::size_t>(counts[i]);
      by_cell_[cells[i]] = std::span(points_).subspan(begin, size);
      begin += size;
    }
  }
  const std::span<const std::int64_t>* find(std::uint64_t cell) const {
    const auto found = by_cell_.find(static_cast<std::int64_t>(cell));
    return found == by_cell_.end() ? nullptr : &found->second;
  }

 private:
  std::vector<std::int64_t> points_;
  std::unordered_map<std::int64_t, std::span<const std::int64_t>> by_cell_;
};

}  // namespace

StagedCells::StagedCells(VtuPlan& plan, Spool& spool)
    : nodes_(spool, sizeof(std::int64_t)),
      node_ends_(spool, sizeof(std::int64_t)),
      types_(spool, 1),
      streams_(spool, sizeof(std::int64_t)),
      stream_ends_(spool, sizeof(std::int64_t)),
      polyhedra_(plan.has_polyhedra()) {
  const ReorderedPolyhedra reordered(plan);
  std::vector<std::int64_t> nodes;
  std::uint64_t cell = 0;
  plan.for_each_typed_cell([&](int type, const std::vector<std::uint64_t>& numbers) {
    nodes.assign(numbers.begin(), numbers.end());
    if (type == vtk::kPolyhedron) {
      streams_.append(nodes.size(), reinterpret_cast<const std::byte*>(nodes.data()));
      nodes = first_uses(nodes);
      if (plan.sorts_points()) std::sort(nodes.begin(), nodes.end());
      if (const auto* own = reordered.find(cell)) nodes.assign(own->begin(), own->end());
    }
    nodes_.append(nodes.size(), reinterpret_cast<const std::byte*>(nodes.data()));
    node_ends_.set(cell, static_cast<std::int64_t>(nodes_.size()));
    types_.set(cell, static_cast<std::uint8_t>(type));
    if (polyhedra_) stream_ends_.set(cell, static_cast<std::int64_t>(streams_.size()));
    ++cell;
  });
}

std::uint64_t StagedCells::count(std::string_view name, const PieceRange& piece) {
  if (piece.cells == 0) return 0;
  if (name == kOffsets || name == kTypes || name == kFaceOffsets || name == kPolyhedronEnds)
    return piece.cells;
  std::uint64_t sum = 0;
  if (name == kConnectivity) {
    return static_cast<std::uint64_t>(begin_of(node_ends_, piece.first_cell + piece.cells) -
                                      begin_of(node_ends_, piece.first_cell));
  }
  numbers(name, piece, [&](std::span<const std::int64_t> part) { sum += part.size(); });
  return sum;
}

void StagedCells::ends(PagedArray& all, const PieceRange& piece, const Take& take) {
  const std::int64_t base = begin_of(all, piece.first_cell);
  std::vector<std::int64_t> part;
  for (std::uint64_t done = 0; done < piece.cells; done += part.size()) {
    part.resize(std::min(kPieceNumbers, piece.cells - done));
    all.read(piece.first_cell + done, part.size(), reinterpret_cast<std::byte*>(part.data()));
    for (std::int64_t& end : part) end -= base;
    take(part);
  }
}

void StagedCells::numbers(std::string_view name, const PieceRange& piece, const Take& take) {
  if (piece.cells == 0) return;
  if (name == kOffsets) return ends(node_ends_, piece, take);
  std::vector<std::int64_t> part;
  if (name == kConnectivity) {
    const auto begin = static_cast<std::uint64_t>(begin_of(node_ends_, piece.first_cell));
    const std::uint64_t total = count(name, piece);
    for (std::uint64_t done = 0; done < total; done += part.size()) {
      part.resize(std::min(kPieceNumbers, total - done));
      nodes_.read(begin + done, part.size(), reinterpret_cast<std::byte*>(part.data()));
      for (std::int64_t& node : part) node -= static_cast<std::int64_t>(piece.first_point);
      take(part);
    }
  } else if (name == kTypes) {
    std::vector<std::uint8_t> narrow;
    for (std::uint64_t done = 0; done < piece.cells; done += part.size()) {
      narrow.resize(std::min(kPieceNumbers, piece.cells - done));
      types_.read(piece.first_cell + done, narrow.size(),
                  reinterpret_cast<std::byte*>(narrow.data()));
      part.assign(narrow.begin(), narrow.end());
      take(part);
    }
  } else {
    face_numbers(name, piece, take);
  }
}

void StagedCells::faces_of(const PieceRange& piece,
                           const std::function<void(std::uint64_t, std::int64_t)>& head,
                           const std::function<void(std::span<const std::int64_t>)>& face) {
  std::vector<std::int64_t> stream;
  for (std::uint64_t c = 0; c < piece.cells; ++c) {
    const std::uint64_t cell = piece.first_cell + c;
    stream.clear();
    if (polyhedra_) {
      const std::int64_t begin = begin_of(stream_ends_, cell);
      stream.resize(static_cast<std::size_t>(stream_ends_.get<std::int64_t>(cell) - begin));
      streams_.read(static_cast<std::uint64_t>(begin), stream.size(),
                    reinterpret_cast<std::byte*>(stream.data()));
    }
    head(c, stream.empty() ? -1 : stream[0]);
    for (std::size_t position = 1; position < stream.size();) {
      const auto size = static_cast<std::size_t>(stream[position++]);
      for (std::size_t i = 0; i < size; ++i)
        stream[position + i] -= static_cast<std::int64_t>(piece.first_point);
      face(std::span(stream).subspan(position, size));
      position += size;
    }
  }
}

void StagedCells::face_numbers(std::string_view name, const PieceRange& piece, const Take& take) {
  Buffer out(take);
  std::int64_t stream_end = 0, faces = 0, points = 0;
  // State of the current cell, whose entry in faceoffsets is written after all of its faces. -2: no
  // cell has begun, so no entry is pending. -1: the cell is not a polyhedron; its entry is
  // -1. 0: the cell is a polyhedron; its entry is the end of its face stream.
  std::int64_t waiting = -2;
  faces_of(
      piece,
      [&](std::uint64_t, std::int64_t count) {
        if (name == kFaceOffsets && waiting != -2) out.add(waiting == -1 ? -1 : stream_end);
        if (count >= 0) ++stream_end;
        waiting = count < 0 ? -1 : 0;
        faces += std::max<std::int64_t>(count, 0);
        if (name == kFaces && count >= 0) out.add(count);
        if (name == kPolyhedronEnds) out.add(faces);
        for (std::int64_t f = 0; name == kPolyhedronFaces && f < count; ++f)
          out.add(faces - count + f);
      },
      [&](std::span<const std::int64_t> face) {
        stream_end += static_cast<std::int64_t>(1 + face.size());
        points += static_cast<std::int64_t>(face.size());
        if (name == kFaces) out.add(static_cast<std::int64_t>(face.size()));
        if (name == kFaceEnds) out.add(points);
        if (name == kFaces || name == kFaceConnectivity)
          for (const std::int64_t point : face) out.add(point);
      });
  if (name == kFaceOffsets && waiting != -2) out.add(waiting == -1 ? -1 : stream_end);
  out.flush();
}

}  // namespace shm::converters::vtu
