// Common base of the SourceFormats of legacy and XML files of VTK.
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
  // Field data with one number of any type.
  std::optional<double> time(const MeshInfo& info, Keys& used) const override;
  // The extras of one file of a series, with the time of the step.
  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override;
  std::vector<Extra> extras_of_series(const MeshInfo& info) const override;
  // True for field data and the skeleton, which has titles and the order of arrays.
  bool is_about_file(std::string_view key) const override;
  // Leaves out extras that are about the appended file.
  std::optional<AppendedExtras> joined_extras(const MeshInfo& old, const MeshInfo& more,
                                              const std::vector<Extra>& extras,
                                              std::span<const std::uint64_t> steps) const override;
  // Names from field data that block_names_extra() made.
  std::map<std::int64_t, std::string> block_names(const MeshInfo& info, Keys& used) const override;

  bool has_strings(const ArrayInfo& array) const override;
  std::vector<std::string> strings(const MeshInfo& info, std::size_t array) const override;
  bool is_list_of_strings(std::string_view key) const override;
  // Adds kNewNumbering if the skeleton of the whole mesh has cells with the newer node order.
  void mark_piece(const MeshInfo& whole, MeshInfo& piece) const override;

 protected:
  // Returns the skeleton without ranges of values.
  virtual std::string skeleton_without_ranges(const MeshInfo& info) const = 0;

  constexpr FamilySource() = default;
  ~FamilySource() = default;
};

}  // namespace shm::converters::vtk
