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
  // Returns the value of the field data that states the time: one number of any type. Returns
  // nothing if there is none.
  std::optional<double> time(const MeshInfo& info, Keys& used) const override;
  // Returns the extras of one file of a series of which the selected steps are written, with the
  // time of the step.
  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override;
  std::vector<Extra> extras_of_series(const MeshInfo& info) const override;
  // Returns true for field data and for the skeleton, which contains the title and the order of
  // arrays.
  bool is_about_file(std::string_view key) const override;
  // Returns the extras without those that describe only the appended file.
  std::optional<AppendedExtras> joined_extras(const MeshInfo& old, const MeshInfo& more,
                                              const std::vector<Extra>& extras,
                                              std::span<const std::uint64_t> steps) const override;
  // Returns block names from the field data that block_names_extra() created.
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
