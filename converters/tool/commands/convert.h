// shm convert and shm decompress: write a mesh in another format.
#pragma once

#include <string>

#include "interface/format.h"
#include "tool/running/command.h"
#include "tool/step_choice.h"

namespace shm::converters {

class MeshSource;
class ProgressLine;
class Spool;
class StepFiles;
class ToolInput;

struct ConvertCommand : FileCommand {
  std::string format;  // output format; if empty, it is derived from the output name
  StepChoice steps;
  bool strict = false;
  bool keeps_attributes = false;  // copy permissions and modification time of IN to OUT

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;

 protected:
  ExitCode write(ToolInput& in);

 private:
  ExitCode write_one(MeshSource& mesh, const Format& target, Spool& spool, ProgressLine& line);
  ExitCode write_each(MeshSource& mesh, const StepFiles& step_files, Spool& spool,
                      ProgressLine& line);
  void remove_input(const LossList& losses, ProgressLine& line);
  bool stops_for(const LossList& losses, ProgressLine& line) const;
};

struct DecompressCommand final : ConvertCommand {
  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  bool is_for(const Format* of_file) const override;
  bool changes_size() const override { return true; }
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;

 private:
  // Returns true if IN is an archive with several members. In this case, run() writes the members
  // to a folder, as shm split does.
  bool is_to_split() const;
  std::string output_of_archive(const std::string& path) const;
  static std::string name_of_series(const std::string& name, const Format& written);

  bool splits_ = false;  // result of is_to_split(), stored by places()
};

}  // namespace shm::converters
