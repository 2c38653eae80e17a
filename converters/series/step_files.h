// StepFiles: the output files of a command that writes a mesh. The output is a single file, a
// series with one file per step (out_%04d.vtu), or a collection (out.pvd) that lists one file per
// step in a folder next to it (out/out_0000.vtu, ...).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/chosen_steps.h"
#include "series/numbered_name.h"

namespace shm::converters {

class StepFiles {
 public:
  // `format` is the name of the file format. If it is empty, the format is derived from the name of
  // the output. Throws Failure (misuse) if that is not possible.
  StepFiles(const std::string& output, const std::string& format);

  const Format& format() const { return *format_; }
  bool is_one_file() const { return !name_; }

  // Call these functions if the output consists of several files: begin() before the first file is
  // written, and finish() after the last file. finish() writes the .pvd file of a collection. These
  // functions may throw Failure (output).
  std::vector<std::string> files_there() const;
  std::string file(std::uint64_t step) const { return name_->at(step); }
  std::string files(StepRange steps) const;  // returns e.g. "x_0003.vtu to x_0007.vtu"
  void begin() const;
  void finish(const MeshInfo& info, StepRange steps, Spool& spool) const;

 private:
  const Format* format_;
  std::string output_;
  bool is_collection_;
  std::optional<NumberedName> name_;
};

// Returns the steps of `info` that are written to one file each: the steps in `chosen`, or all
// steps if `chosen` is empty. A mesh without steps counts as one step. For such a mesh, `chosen`
// must be empty.
StepRange steps_in_files(const MeshInfo& info, std::optional<StepRange> chosen);
// Returns the range that contains only `step`, for use with Conversion and Translation. Returns
// nothing if the mesh has no steps.
std::optional<StepRange> step_in_file(const MeshInfo& info, std::uint64_t step);

}  // namespace shm::converters
