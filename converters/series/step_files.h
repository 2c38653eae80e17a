// StepFiles: the files to which a command writes a mesh: one file, a file for each step
// (out_%04d.vtu), or a collection (out.pvd) of files in a folder next to it (out/out_0000.vtu,
// ...).
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
  // `format`: format of the files; may be empty. Throws Failure (misuse) if the format cannot be
  // derived from the name either.
  StepFiles(const std::string& output, const std::string& format);

  const Format& format() const { return *format_; }
  bool is_one_file() const { return !name_; }

  // Functions for several files. Call begin() before the first file is written, and finish() after
  // the last one; finish() writes the collection. All of them may throw Failure (output).
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

// Returns the steps of `info` that `chosen` selects, for files with one step each. A mesh without
// steps is written to one file, and no step can be selected.
StepRange steps_in_files(const MeshInfo& info, std::optional<StepRange> chosen);
// Returns one of these steps in the form that Conversion and Translation expect. Returns nothing if
// the mesh has no steps.
std::optional<StepRange> step_in_file(const MeshInfo& info, std::uint64_t step);

}  // namespace shm::converters
