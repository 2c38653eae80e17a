// Base class of the SourceFormats of VTK's legacy files and XML files.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interface/format.h"

namespace shm::converters::vtk {

class FamilySource : public SourceFormat {
 public:
  // Returns the time that the field data of the mesh states as a single number of any type. Returns
  // nothing if no such field data exists.
  std::optional<double> time(const MeshInfo& info, Keys& used) const override;
  // Returns the extras for a mesh that is reduced to some of its steps. The mesh must come from a
  // series of files with one step each; otherwise returns nothing. If there is only one step, its
  // time replaces the time in the extras.
  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override;
  std::vector<Extra> extras_of_series(const MeshInfo& info) const override;
  // Returns true if the key is that of field data or of the skeleton, which contains the title and
  // the order of arrays.
  bool is_about_file(std::string_view key) const override;
  // Returns the extras of the result without extras that describe only the appended file.
  std::optional<AppendedExtras> joined_extras(const MeshInfo& old, const MeshInfo& more,
                                              const std::vector<Extra>& extras,
                                              std::span<const std::uint64_t> steps) const override;
  // Returns the names of blocks in the field data that block_names_extra() creates.
  std::map<std::int64_t, std::string> block_names(const MeshInfo& info, Keys& used) const override;

  bool has_strings(const ArrayInfo& array) const override;
  std::vector<std::string> strings(const MeshInfo& info, std::size_t array) const override;
  bool is_list_of_strings(std::string_view key) const override;
  // Adds kNewNumbering to the extras of a piece if the skeleton of the whole mesh states that cells
  // have the newer node order.
  void mark_piece(const MeshInfo& whole, MeshInfo& piece) const override;

 protected:
  // Returns the skeleton of a mesh without the ranges of values that it contains.
  virtual std::string skeleton_without_ranges(const MeshInfo& info) const = 0;

  constexpr FamilySource() = default;
  ~FamilySource() = default;
};

}  // namespace shm::converters::vtk
