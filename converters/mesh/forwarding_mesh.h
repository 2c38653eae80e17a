// ForwardingMesh: a mesh that forwards all calls to another mesh, except for the functions that a
// derived class overrides.
#pragma once

#include <utility>

#include "mesh/mesh_source.h"

namespace shm::converters {

class ForwardingMesh : public MeshSource {
 public:
  explicit ForwardingMesh(MeshSource& source) : source_(source) {}  // borrowed
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    source_.read_points(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    return source_.next_cells(out, max_cells);
  }
  void rewind_cells() override { source_.rewind_cells(); }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    source_.read_array(array, step, first, count, out);
  }

 protected:
  MeshSource& source_;
  MeshInfo info_;  // set by the derived class
};

}  // namespace shm::converters
