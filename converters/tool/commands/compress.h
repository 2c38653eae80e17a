// shm compress: compresses a mesh with all its data into a .shm file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compression/compress.h"

#include "tool/progress_line.h"
#include "tool/running/command.h"

namespace shm::converters {

struct CompressCommand final : FileCommand {
  std::string order = "keep", level = "default", codec = "auto", cell_order;
  // Number of cells in the delay buffer. If the user gives no number, the default depends on
  // `order`: with stream, a trial chooses the number; otherwise the encoder has no delay buffer.
  std::optional<std::uint32_t> delay;
  std::uint32_t bits = 0;
  std::optional<std::string> abs, rel;
  std::vector<std::string> arrays;  // values of --array: NAME:ACCURACY or NAME:fill=VALUE
  std::vector<std::string> fills;   // values of --fill
  std::optional<double> parity;     // size of the parity as a percentage of the file size
  std::uint64_t segment_cells = 0;
  // Maximum percentage of vertices that are stored twice because two segments use them.
  double restart_budget = .2;
  std::optional<std::uint32_t> key_steps;
  bool no_digest = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  bool is_for(const Format* format) const override;
  std::string why_passed_over(const std::string& path) const override;
  bool changes_size() const override { return true; }
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;
  // Converts the command-line options to CompressOptions, except --cell-order. The result has no
  // progress callback. Throws Failure (misuse).
  CompressOptions how() const;

 private:
  Lossy lossy() const;
  void check_use() const;
  std::vector<ExpectedPhase> phases_of(const MeshInfo& info) const;
  SizeReport write_to_pipe(MeshSource& mesh, const CompressOptions& how, Spool& spool) const;
  SizeReport write_to_file(MeshSource& mesh, const CompressOptions& how, Spool& spool) const;
};

}  // namespace shm::converters
