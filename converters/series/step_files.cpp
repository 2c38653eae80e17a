#include "series/step_files.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "base/failure.h"
#include "base/output_file.h"
#include "formats/formats.h"
#include "vtk/xml/collection.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

// Format of the files in a collection. shm writes no other format that the programs that read
// collections support.
constexpr const char* kFilesFormat = "vtu";
constexpr std::size_t kFileDigits = 4;

bool names_collection(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".pvd";
}

const Format& format_of_files(const std::string& output, const std::string& format,
                              bool is_collection) {
  if (!is_collection) return output_format(output, format);
  if (!format.empty() && format != kFilesFormat)
    wrong_use(output + ": a collection consists of VTU files, but --format is " + format);
  return *format_named(kFilesFormat);
}

std::string folder_of_collection(const std::string& path) {
  return fs::path(path).replace_extension().string();
}

std::optional<NumberedName> name_of_files(const std::string& output, bool is_collection) {
  if (!is_collection) return NumberedName::of(output);
  const std::string folder = folder_of_collection(output);
  return NumberedName(folder + '/' + fs::path(folder).filename().string() + '_', kFileDigits,
                      std::string(".") + kFilesFormat);
}

}  // namespace

StepFiles::StepFiles(const std::string& output, const std::string& format)
    : format_(&format_of_files(output, format, names_collection(output))),
      output_(output),
      is_collection_(names_collection(output)),
      name_(name_of_files(output, is_collection_)) {}

std::vector<std::string> StepFiles::files_there() const {
  std::vector<std::string> paths;
  std::error_code none;
  if (const std::string folder = folder_of_collection(output_);
      is_collection_ && fs::exists(folder, none) && !fs::is_directory(folder, none))
    throw Failure(ErrorCode::output, "is not a folder, but " + output_ + " needs one", folder);
  if (name_)
    for (const NumberedName::File& file : name_->files()) paths.push_back(file.path);
  return paths;
}

std::string StepFiles::files(StepRange steps) const {
  return file(steps.first) + (steps.size() > 1 ? " to " + file(steps.end - 1) : "");
}

void StepFiles::begin() const {
  if (!is_collection_) return;
  const std::string folder = folder_of_collection(output_);
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) throw Failure(ErrorCode::output, "cannot be created: " + error.message(), folder);
}

void StepFiles::finish(const MeshInfo& info, StepRange steps, Spool& spool) const {
  if (!is_collection_) return;
  Keys used;
  const double only = source_format(info).time(info, used).value_or(0);
  const fs::path folder = fs::path(output_).parent_path();
  std::vector<CollectedFile> files;
  for (std::uint64_t step = steps.first; step < steps.end; ++step)
    files.push_back({info.step_times.empty() ? only : info.step_times[step],
                     fs::path(file(step)).lexically_relative(folder).generic_string()});
  const std::string text = collection_text(files);
  OutputFile output(output_, spool.directory());
  output.write(std::as_bytes(std::span(text)));
  output.commit();
}

StepRange steps_in_files(const MeshInfo& info, std::optional<StepRange> chosen) {
  return chosen.value_or(StepRange{0, std::max<std::size_t>(info.step_times.size(), 1)});
}

std::optional<StepRange> step_in_file(const MeshInfo& info, std::uint64_t step) {
  return info.step_times.empty() ? std::nullopt : std::optional(StepRange{step, step + 1});
}

}  // namespace shm::converters
