#include "random/vertex_buffer.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace shm {

std::array<double, 3> point_of(const std::byte* xyz, ScalarType type) {
  std::array<double, 3> point{};
  if (type == ScalarType::float32) {
    std::array<float, 3> narrow{};
    std::memcpy(narrow.data(), xyz, sizeof narrow);
    for (std::size_t c = 0; c < 3; ++c) point[c] = static_cast<double>(narrow[c]);
  } else {
    std::memcpy(point.data(), xyz, sizeof point);
  }
  return point;
}

bool is_in(const std::array<double, 6>& box, const std::array<double, 3>& point) {
  for (std::size_t c = 0; c < 3; ++c)
    if (!std::isfinite(point[c]) || point[c] < box[c] || point[c] > box[3 + c]) return false;
  return true;
}

VertexBuffer::VertexBuffer(const Schema& schema, std::vector<std::uint32_t> arrays,
                           bool coordinates)
    : schema_(&schema),
      arrays_(std::move(arrays)),
      xyz_bytes_(coordinates ? 3 * scalar_bytes(schema.coordinate_type) : 0),
      record_bytes_(xyz_bytes_) {
  for (const std::uint32_t a : arrays_) {
    strides_.push_back(scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components);
    record_bytes_ += strides_.back();
  }
}

bool VertexBuffer::add(const MeshBlock& block, std::size_t v, bool in_box) {
  Vertex vertex;
  vertex.number = block.vertex_numbers[v];
  vertex.imported = block.imported[v] != 0;
  vertex.in_box = in_box;
  const auto [place, fresh] = vertices_.try_emplace(vertex.number, vertex);
  if (!fresh) return false;
  if (free_.empty()) {
    free_.push_back(records_.size());
    records_.resize(records_.size() + record_bytes_);
  }
  place->second.record = free_.back();
  free_.pop_back();
  std::byte* to = records_.data() + place->second.record;
  if (xyz_bytes_ > 0) std::memcpy(to, block.xyz.data() + v * xyz_bytes_, xyz_bytes_);
  to += xyz_bytes_;
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    std::memcpy(to, block.arrays[arrays_[i]].data() + v * strides_[i], strides_[i]);
    to += strides_[i];
  }
  in_box_ += in_box ? 1 : 0;
  return true;
}

VertexBuffer::Vertex* VertexBuffer::find(std::uint64_t number) {
  const auto found = vertices_.find(number);
  return found == vertices_.end() ? nullptr : &found->second;
}

void VertexBuffer::remove(std::uint64_t number) {
  const auto found = vertices_.find(number);
  if (found == vertices_.end()) return;
  in_box_ -= found->second.in_box ? 1 : 0;
  free_.push_back(found->second.record);
  vertices_.erase(found);
}

void VertexBuffer::clear() {
  vertices_.clear();
  records_.clear();
  free_.clear();
  in_box_ = 0;
}

std::array<double, 3> VertexBuffer::point(const Vertex& vertex) const {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  if (xyz_bytes_ == 0) return {kNan, kNan, kNan};
  return point_of(records_.data() + vertex.record, schema_->coordinate_type);
}

void VertexBuffer::give(const Vertex& vertex, MeshBlock& out) const {
  out.vertex_numbers.push_back(vertex.number);
  const std::byte* from = records_.data() + vertex.record;
  out.xyz.insert(out.xyz.end(), from, from + xyz_bytes_);
  from += xyz_bytes_;
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    auto& to = out.arrays[arrays_[i]];
    to.insert(to.end(), from, from + strides_[i]);
    from += strides_[i];
  }
}

}  // namespace shm
