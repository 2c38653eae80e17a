#include "vtk/cell_plan.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "base/failure.h"
#include "base/stored_value.h"
#include "vtk/values.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

void fail_extra(const std::string& key, std::string detail) {
  throw Failure(Error{
      .code = ErrorCode::corrupt, .detail = std::move(detail), .section = "extra '" + key + "'"});
}

const Extra* CellPlan::extra(const std::string& key) const {
  const auto found = extras_.find(key);
  return found == extras_.end() ? nullptr : found->second;
}

std::vector<std::int64_t> CellPlan::integers(const std::string& key) const {
  std::vector<std::int64_t> values;
  const Extra* found = extra(key);
  if (found == nullptr) return values;
  if (found->type != ScalarType::int32 && found->type != ScalarType::int64)
    fail_extra(key, "has values of the wrong type");
  with_scalar(found->type, [&](auto value) {
    for (std::size_t offset = 0; offset + sizeof value <= found->data.size();
         offset += sizeof value) {
      std::memcpy(&value, found->data.data() + offset, sizeof value);
      values.push_back(static_cast<std::int64_t>(value));
    }
  });
  return values;
}

CellPlan::CellPlan(MeshSource& mesh) : mesh_(mesh), info_(mesh.info()) {
  for (const Extra& each : info_.extras) extras_.emplace(each.key, &each);
  load_cell_types();
  load_polyhedra();
}

void CellPlan::load_cell_types() {
  const std::string key = "vtk/cell_types";
  const std::vector<std::int64_t> types = integers(key);
  const auto& blocks = info_.schema.blocks;
  const std::string& source = info_.schema.source_format;
  const bool own = (source == "vtk" || source == "vtu") && !types.empty();
  if (own && types.size() != blocks.size())
    fail_extra(key, "has " + std::to_string(types.size()) + " types for " +
                        std::to_string(blocks.size()) + " blocks");
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (own && (types[b] < 0 || types[b] > 255)) fail_extra(key, "has an unknown cell type");
    block_types_.push_back(own ? static_cast<int>(types[b]) : cell_type_of_block(blocks[b]));
  }
}

bool CellPlan::makes_lagrange_cells() const {
  const std::string& source = info_.schema.source_format;
  return source != "vtk" && source != "vtu" &&
         std::any_of(block_types_.begin(), block_types_.end(), [](int type) {
           return type == kLagrangeHexahedron || type == kBezierHexahedron;
         });
}

void CellPlan::load_polyhedra() {
  bool faces_in_extras = false;  // true if the faces are in the extras vtk/polyhedron/...
  for (std::size_t b = 0; b < block_types_.size(); ++b) {
    if (block_types_[b] != kPolyhedron) continue;
    has_polyhedra_ = has_polyhedra_ || info_.block_cells[b] > 0;
    faces_in_extras = faces_in_extras || info_.schema.blocks[b].shape != CellShape::faces;
  }
  if (!faces_in_extras) return;
  const std::vector<std::int64_t> cells = integers("vtk/polyhedron/cells");
  const std::vector<std::int64_t> faces = integers("vtk/polyhedron/faces");
  face_sizes_ = integers("vtk/polyhedron/face_sizes");
  if (faces.size() != cells.size())
    fail_extra("vtk/polyhedron/faces", "the length differs from the number of polyhedra");
  std::uint64_t first = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (faces[i] < 0 || static_cast<std::uint64_t>(faces[i]) > face_sizes_.size() - first)
      fail_extra("vtk/polyhedron/faces", "states more faces than there are");
    polyhedra_.push_back({cells[i], static_cast<std::uint64_t>(faces[i]), first});
    first += static_cast<std::uint64_t>(faces[i]);
  }
  std::sort(polyhedra_.begin(), polyhedra_.end(),
            [](const Polyhedron& a, const Polyhedron& b) { return a.cell < b.cell; });
}

void CellPlan::for_each_filled(std::size_t array, std::uint64_t step, const Values& body) {
  const ArrayInfo& info = info_.schema.arrays[array];
  const std::size_t stride = info_.array_stride(array);
  std::vector<std::byte> nothing(stride);
  with_scalar(info.type, [&](auto value) {
    using T = decltype(value);
    if constexpr (std::is_floating_point_v<T>) value = std::numeric_limits<T>::quiet_NaN();
    for (std::uint32_t c = 0; c < info.components; ++c)
      std::memcpy(nothing.data() + c * sizeof value, &value, sizeof value);
  });
  std::uint64_t next = 0;
  std::vector<std::byte> covered, all;
  for_each_batch([&](const CellBatch& batch) {
    std::uint64_t n = 0;
    for (const std::uint32_t block : batch.blocks) n += info_.schema.array_covers(array, block);
    covered.resize(n * stride);
    mesh_.read_array(array, step, next, n, covered.data());
    next += n;
    all.clear();
    auto from = covered.begin();
    for (const std::uint32_t block : batch.blocks) {
      const bool has_value = info_.schema.array_covers(array, block);
      const auto& source = has_value ? from : nothing.begin();
      all.insert(all.end(), source, source + static_cast<std::ptrdiff_t>(stride));
      if (has_value) from += static_cast<std::ptrdiff_t>(stride);
    }
    body(all);
  });
}

// Extracts the faces from `corners`, the vertex list of a polyhedron with CellShape::faces. In this
// list, each face ends with a repetition of its first vertex.
void CellPlan::unpack_faces(std::span<const std::uint64_t> corners) {
  numbers_.assign(1, 0);
  for (auto from = corners.begin(); from != corners.end();) {
    const auto end = std::find(from + 1, corners.end(), *from);
    if (end == corners.end())
      throw Failure(Error{.code = ErrorCode::corrupt,
                          .detail = "a face does not end with its first vertex",
                          .section = "cell " + std::to_string(cell_)});
    ++numbers_[0];
    numbers_.push_back(static_cast<std::uint64_t>(end - from));
    numbers_.insert(numbers_.end(), from, end);
    from = end + 1;
  }
}

void CellPlan::file_numbers(std::uint32_t block, std::span<const std::uint64_t> corners) {
  const int type = block_types_[block];
  if (type != kPolyhedron) {
    numbers_.assign(corners.begin(), corners.end());
    permute_nodes(type, numbers_.data(), numbers_.size(), old_numbering_);
    return;
  }
  if (info_.schema.blocks[block].shape == CellShape::faces) return unpack_faces(corners);
  const auto cell = static_cast<std::int64_t>(cell_);
  while (next_polyhedron_ < polyhedra_.size() && polyhedra_[next_polyhedron_].cell < cell)
    ++next_polyhedron_;
  if (next_polyhedron_ == polyhedra_.size() || polyhedra_[next_polyhedron_].cell != cell)
    fail_extra("vtk/polyhedron/cells", "lacks cell " + std::to_string(cell_));
  const Polyhedron& faces = polyhedra_[next_polyhedron_];
  numbers_.assign(1, faces.faces);
  std::size_t corner = 0;
  for (std::uint64_t f = 0; f < faces.faces; ++f) {
    const auto size = static_cast<std::uint64_t>(face_sizes_[faces.first_size + f]);
    if (size > corners.size() - corner) break;
    numbers_.push_back(size);
    const auto from = corners.begin() + static_cast<std::ptrdiff_t>(corner);
    numbers_.insert(numbers_.end(), from, from + static_cast<std::ptrdiff_t>(size));
    corner += size;
  }
  if (corner != corners.size() || numbers_.size() != 1 + faces.faces + corner)
    fail_extra("vtk/polyhedron/face_sizes", "does not fit cell " + std::to_string(cell_));
}

}  // namespace shm::converters::vtk
