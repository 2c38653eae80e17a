#include "tool/running/many_files.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include "archive/damage_report.h"
#include "base/failure.h"
#include "formats/formats.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/failures.h"
#include "tool/running/file_list.h"
#include "tool/running/processes.h"

namespace shm::converters {
namespace {

bool is_folder(const std::string& path) {
  std::error_code none;
  return std::filesystem::is_directory(path, none);
}

FilePurpose purpose_of(const FileCommand& command) {
  FilePurpose purpose;
  purpose.recursive = command.recursive;
  purpose.folder = command.output;
  purpose.is_for = [&](const Format* format) { return command.is_for(format); };
  purpose.why_passed_over = [&](const std::string& path) { return command.why_passed_over(path); };
  purpose.output_beside = [&](const std::string& path) { return command.output_beside(path); };
  return purpose;
}

int run_on_one(FileCommand& command) {
  command.input = standard_or(command.files[0], STDIN_FILENO);
  const std::string why = command.why_passed_over(command.input);
  if (!why.empty()) {
    std::fprintf(stderr, "shm: %s: %s\n", command.input.c_str(), why.c_str());
    return kDone;
  }
  if (command.output.empty()) command.output = command.output_beside(command.input);
  if (is_folder(command.output) && command.input != "-") {
    const std::filesystem::path name = std::filesystem::path(command.output_beside(command.input));
    command.output = (std::filesystem::path(command.output) / name.filename()).string();
  }
  check_places(command.places(), command.force);
  return command.run();
}

// Returns the identity of the file at `path` (device and inode), which does not depend on the name.
// Returns nothing if the file does not exist.
std::optional<std::pair<dev_t, ino_t>> identity(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return std::pair(status.st_dev, status.st_ino);
}

// Finds the tasks that must be refused. Call this before any task runs. Also creates the folders of
// the outputs.
void check_tasks(FileCommand& command, FileList& list) {
  std::set<std::pair<dev_t, ino_t>> inputs;
  for (const FileTask& task : list.tasks)
    if (const auto file = identity(task.input); file && task.passed_over.empty())
      inputs.insert(*file);
  for (FileTask& task : list.tasks) {
    if (!task.refusal || !task.passed_over.empty() || task.output.empty() ||
        task.output.ends_with('/'))
      continue;
    try {
      if (!command.output.empty() && command.recursive)
        std::filesystem::create_directories(std::filesystem::path(task.output).parent_path());
      const auto there = identity(task.output);
      if (there && inputs.contains(*there))
        throw Failure(ErrorCode::output, "is one of the inputs, and is not overwritten",
                      task.output);
      check_places({{task.input}, task.output, false}, command.force);
    } catch (const Failure& failure) {
      task.refusal = failure.error();
    } catch (const std::filesystem::filesystem_error& error) {
      task.refusal = Error{.code = ErrorCode::output, .detail = error.what(), .file = task.output};
    }
  }
}

// Reformats a text that contains several JSON documents, so that each document is on one line.
std::string on_lines(const std::string& text) {
  std::string lines;
  std::istringstream documents(text);
  while (documents >> std::ws && !documents.eof()) {
    nlohmann::ordered_json document;
    documents >> document;
    lines += document.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  }
  return lines;
}

// Loads the libraries that some formats need, so that child processes need not load them again.
// Loads a library only if the names of at least two files indicate its format. If a library cannot
// be loaded, the error is reported later, for the file that needs the library.
void load_libraries(const FileList& list) {
  std::map<const Format*, std::size_t> files;
  for (const FileTask& task : list.tasks)
    for (const std::string& path : {task.input, task.output})
      if (const Format* format = format_of_name(path);
          format != nullptr && format->load != nullptr && ++files[format] == 2) {
        try {
          format->load();
        } catch (const Failure&) {
        }
      }
}

class Sum {
 public:
  explicit Sum(const FileCommand& command) : command_(command) {}

  void add(const FileTask& task, const Printed& printed) {
    const int code = task.refusal ? task.code : exit_code(task.refusal.error().code);
    code_ = std::max(code_, code);
    const bool is_failure = code != kDone || !task.refusal;
    ++(is_failure ? failed_ : task.passed_over.empty() ? done_ : passed_over_);
    std::string error = printed.error;
    if (!task.refusal) error = "shm: " + task.refusal.error().message() + "\n";
    if (!task.passed_over.empty()) error = "shm: " + task.input + ": " + task.passed_over + "\n";
    std::fputs(error.c_str(), stderr);
    if (!is_failure && task.passed_over.empty()) {
      input_bytes_ += task.bytes;
      if (!task.output.empty() && !is_folder(task.output)) output_bytes_ += file_bytes(task.output);
    }
    if (command_.json)
      print_json(task, printed, error, code);
    else
      std::fputs(printed.out.c_str(), stdout);
    std::fflush(stdout);
  }

  int end(std::uint64_t others) const {
    if (command_.json) {
      nlohmann::ordered_json sum = {{"files", done_ + passed_over_ + failed_},
                                    {"done", done_},
                                    {"passed_over", passed_over_},
                                    {"failed", failed_},
                                    {"other_files", others},
                                    {"input_bytes", input_bytes_}};
      if (command_.changes_size()) sum["output_bytes"] = output_bytes_;
      std::fputs((sum.dump() + "\n").c_str(), stdout);
    } else if (!command_.quiet) {
      std::fputs(text(others).c_str(), stdout);
    }
    return code_;
  }

 private:
  void print_json(const FileTask& task, const Printed& printed, const std::string& error,
                  int code) const {
    std::string lines = on_lines(printed.out);
    if (lines.empty()) {
      nlohmann::ordered_json line = {{"file", task.input}, {"exit_code", code}};
      if (!error.empty())
        line[code == kDone ? "passed_over" : "error"] = error.substr(0, error.size() - 1);
      lines = line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    }
    std::fputs(lines.c_str(), stdout);
  }

  std::string text(std::uint64_t others) const {
    std::string sum =
        counted(done_ + passed_over_ + failed_, "file") + ": " + std::to_string(done_) + " done";
    if (passed_over_ > 0) sum += ", " + std::to_string(passed_over_) + " passed over";
    if (failed_ > 0) sum += ", " + std::to_string(failed_) + " failed";
    if (command_.changes_size()) sum += "; " + ratio_text(output_bytes_, input_bytes_);
    if (others > 0) sum += "; skipped " + counted(others, "other file") + " in folders";
    return sum + "\n";
  }

  const FileCommand& command_;
  int code_ = kDone;
  std::uint64_t done_ = 0, passed_over_ = 0, failed_ = 0, input_bytes_ = 0, output_bytes_ = 0;
};

}  // namespace

int run_on_files(FileCommand& command) {
  command.output = standard_or(command.output, STDOUT_FILENO);
  if (command.remove && (command.to_stdout || command.output == "-"))
    wrong_use("--rm needs an output file, not standard output");
  if (command.to_stdout) {
    if (!command.output.empty()) wrong_use("-c and -o exclude each other");
    command.output = "-";
  }
  if (command.files.size() == 1 && !is_folder(command.files[0])) return run_on_one(command);
  if (command.output == "-")
    wrong_use("only one output can go to standard output, but there are several IN");
  for (const std::string& file : command.files)
    if (file == "-") wrong_use("- is standard input, and cannot be one of several files");
  if (!command.output.empty() && !is_folder(command.output))
    wrong_use("with several files -o is the folder for the outputs; there is no folder " +
              command.output);
  FileList list = list_files(command.files, purpose_of(command));
  check_tasks(command, list);
  Sum sum(command);
  const unsigned threads =
      command.threads > 0 ? command.threads : std::max(1u, std::thread::hardware_concurrency());
  command.is_one_of_many = true;
  const auto work = [&](const FileTask& task, unsigned of_task) {
    command.input = task.input;
    command.output = task.output;
    command.threads = of_task;
    return reported(&command, [&]() -> int {
      command.places();
      return command.run();
    });
  };
  ProgressLine line(command);
  std::uint64_t bytes = 0;
  for (const FileTask& task : list.tasks)
    if (task.refusal && task.passed_over.empty()) bytes += task.bytes;
  line.expect({}, bytes);
  const std::string of_all = " of " + counted(list.tasks.size(), "file");
  const auto progress = [&](std::size_t ended, double share) {
    line.show_share(std::to_string(ended) + of_all, share);
  };
  load_libraries(list);
  run_each(
      list.tasks, threads, work,
      [&](const FileTask& task, const Printed& printed) {
        line.wipe();
        sum.add(task, printed);
      },
      line.is_shown() ? TasksProgress(progress) : TasksProgress());
  line.wipe();
  return sum.end(list.others);
}

}  // namespace shm::converters
