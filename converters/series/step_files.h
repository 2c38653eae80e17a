// StepFiles: where a command writes a mesh: one file, a file for each step (out_%04d.vtu), or a
// collection (out.pvd) of files in a folder beside it (out/out_0000.vtu, ...).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/spool.h"
#include "mesh/chosen_steps.h"
#include "series/numbered_name.h"
#include "transfer/format.h"

namespace shm::converters {

class StepFiles {
 public:
  // `format` of the files, may be empty. Throws Failure (misuse) where it does not follow from the
  // name.
  StepFiles(const std::string& output, const std::string& format);

  const Format& format() const { return *format_; }
  bool is_one_file() const { return !name_; }

  // Of several. begin() comes before the first is written, finish() behind the last one: it writes
  // the collection. All may throw Failure (output).
  std::vector<std::string> files_there() const;
  std::string file(std::uint64_t step) const { return name_->at(step); }
  std::string files(StepRange steps) const;  // "x_0003.vtu to x_0007.vtu"
  void begin() const;
  void finish(const MeshInfo& info, StepRange steps, Spool& spool) const;

 private:
  const Format* format_;
  std::string output_;
  bool is_collection_;
  std::optional<NumberedName> name_;
};

// The steps of `info` that `chosen` means, in files of one step each: a mesh without steps is one
// file, and nothing can be chosen of it.
StepRange steps_in_files(const MeshInfo& info, std::optional<StepRange> chosen);
// Of one of them, what a Conversion or a Translation takes.
std::optional<StepRange> step_in_file(const MeshInfo& info, std::uint64_t step);

}  // namespace shm::converters
