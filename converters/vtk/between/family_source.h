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
  // nothing if the field data does not state a time.
  std::optional<double> time(const MeshInfo& info, Keys& used) const override;
  // Returns the extras that remain when a mesh is reduced to some of its steps. If a single step
  // remains, its time replaces the time in the extras. Returns nothing unless the mesh comes from a
  // series of files with one step each.
  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override;
  std::vector<Extra> extras_of_series(const MeshInfo& info) const override;
  // Returns true if an extra with this key describes the file itself: field data, or the skeleton
  // (the file without its numbers), which contains the title and the order of arrays.
  bool is_about_file(std::string_view key) const override;
  // Determines the extras of the mesh `old` after the file `more` is appended to it. The result
  // keeps the extras of `old` unchanged. If an extra of `more` differs from that of `old` but only
  // describes the file, it is listed as a loss. Returns nothing if any other extra differs, or if
  // `old` does not come from a series of files with one step each.
  std::optional<AppendedExtras> joined_extras(const MeshInfo& old, const MeshInfo& more,
                                              const std::vector<Extra>& extras,
                                              std::span<const std::uint64_t> steps) const override;
  // Returns the block names that block_names_extra() stored in the field data.
  std::map<std::int64_t, std::string> block_names(const MeshInfo& info, Keys& used) const override;

  bool has_strings(const ArrayInfo& array) const override;
  std::vector<std::string> strings(const MeshInfo& info, std::size_t array) const override;
  bool is_list_of_strings(std::string_view key) const override;
  // Adds kNewNumbering to the extras of a piece if the skeleton of the whole mesh shows that the
  // nodes of its cells are in the newer order.
  void mark_piece(const MeshInfo& whole, MeshInfo& piece) const override;

 protected:
  // Returns the skeleton of a mesh (its file without the numbers) without the value ranges of
  // arrays.
  virtual std::string skeleton_without_ranges(const MeshInfo& info) const = 0;

  constexpr FamilySource() = default;
  ~FamilySource() = default;
};

}  // namespace shm::converters::vtk
