#include "tool/running/file_list.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "base/failure.h"
#include "base/unpacked.h"
#include "formats/formats.h"
#include "tool/input.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

Error refusal(ErrorCode code, std::string detail, const std::string& path) {
  return Error{.code = code, .detail = std::move(detail), .file = path};
}

class Listing {
 public:
  explicit Listing(const FilePurpose& purpose) : purpose_(purpose) {}

  void add(const std::string& path) {
    std::error_code none;
    if (!fs::is_directory(path, none)) {
      take({path, {}, {}, {}, {}, 0}, fs::path(path).filename(), true);
    } else if (purpose_.recursive) {
      add_folder(path);
    } else {
      refuse(path,
             refusal(ErrorCode::misuse, "is a folder; use -r to process the files in it", path));
    }
  }
  FileList done() { return std::move(list_); }

 private:
  void refuse(const std::string& path, Error error) {
    FileTask task{path, {}, {}, {}, {}, 0};
    task.refusal = std::move(error);
    list_.tasks.push_back(std::move(task));
  }

  // Adds tasks for all files in a folder and its subfolders. Links are not followed, because they
  // may lead out of the folder or form cycles.
  void add_folder(const std::string& folder) {
    std::error_code error;
    std::vector<fs::path> files;
    fs::recursive_directory_iterator entry(folder, error), end;
    while (!error && entry != end) {
      if (!entry->is_symlink() && entry->is_regular_file()) files.push_back(entry->path());
      entry.increment(error);
    }
    if (error) refuse(folder, refusal(ErrorCode::io, "cannot be read: " + error.message(), folder));
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files)
      take({file.string(), {}, {}, {}, {}, 0}, file.lexically_relative(folder), false);
  }

  // Adds a task for a file. `below` is the path of the file relative to the folder that the user
  // named. `named` is true if the user named the file itself, not a folder that contains it.
  void take(FileTask task, const fs::path& below, bool named) {
    try {
      if (!named && !purpose_.is_for(format_of(task.input))) {
        ++list_.others;
        return;
      }
      std::error_code none;
      const std::uintmax_t bytes = fs::file_size(task.input, none);
      task.bytes = none ? 0 : bytes;
      if (purpose_.why_passed_over) task.passed_over = purpose_.why_passed_over(task.input);
      if (task.passed_over.empty()) find_output(task, below);
    } catch (const Failure& failure) {
      task.refusal = failure.error();
    }
    list_.tasks.push_back(std::move(task));
  }

  static const Format* format_of(const std::string& path) {
    return is_packed(path) ? format_of_name(unpacked_name(path)) : format_of_file(path);
  }

  void find_output(FileTask& task, const fs::path& below) {
    task.output = purpose_.output_beside ? purpose_.output_beside(task.input) : std::string();
    if (task.output.empty()) return;
    if (!purpose_.folder.empty())
      task.output =
          (fs::path(purpose_.folder) / below.parent_path() / fs::path(task.output).filename())
              .string();
    if (task.output.ends_with('/')) return;  // the output is a folder for the members of an archive
    const auto [first, is_new] =
        writers_.emplace(fs::path(task.output).lexically_normal(), task.input);
    if (!is_new)
      throw Failure(
          refusal(ErrorCode::output, "is the output of " + first->second + ", too", task.output));
  }

  const FilePurpose& purpose_;
  FileList list_;
  std::map<fs::path, std::string> writers_;  // maps each output to the input that it is made from
};

}  // namespace

FileList list_files(const std::vector<std::string>& paths, const FilePurpose& purpose) {
  Listing listing(purpose);
  for (const std::string& path : paths) listing.add(path);
  return listing.done();
}

}  // namespace shm::converters
