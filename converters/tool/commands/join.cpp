#include "tool/commands/join.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "formats/formats.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

// Raises the limit for the number of open files. All parts are open at the same time, and there may
// be thousands of parts.
void allow_many_files() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
}

}  // namespace

CLI::App* JoinCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "join",
      "Put several meshes into one .shm file: the pieces of a decomposed mesh, or the files of a\n"
      "restarted run. .shm files are stored unchanged, other files are compressed. With --merge\n"
      "the pieces become one mesh, in which nodes and elements are numbered as before\n"
      "decomposition",
      "  shm join -o rotor.shm rotor.e.4.0 rotor.e.4.1 rotor.e.4.2 rotor.e.4.3\n"
      "  shm join --merge -o rotor.shm rotor.e.4    one mesh of rotor.e.4.0 to rotor.e.4.3\n"
      "  shm join -o run.shm run.e run.e-s002 run.e-s003\n"
      "  shm join -o rounded.shm a.e.shm b.e.shm     files compressed with other options");
  command->add_option("IN", inputs, "Files of format " + format_names())->required()->type_name("");
  command->add_option("-o,--output", output, "File to write")->required()->type_name("OUT.shm");
  command->add_flag("--merge", merge,
                    "Merge the parts of a decomposed Exodus mesh into one mesh, as epu does;\n"
                    "NAME.COUNT means the COUNT files NAME.COUNT.0, NAME.COUNT.1, ...");
  add_force(*command, *this);
  add_order(*command, order);
  add_level(*command, level);
  add_threads(*command, threads, "Encode segments");
  command->add_flag("--json", json, "Print the sizes as JSON");
  return command;
}

Places JoinCommand::places() {
  if (merge) {
    const Format* format = format_of_name(output);
    if (format != nullptr && format->name != "shm")
      wrong_use("join writes .shm files; shm decompress converts them to other formats");
    inputs = files_of_parts(inputs);
  }
  return {inputs, output, true};
}

ExitCode JoinCommand::write_merged(const CompressOptions& how, ProgressLine& line) {
  const auto start = std::chrono::steady_clock::now();
  allow_many_files();
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  const auto mesh = open_merged(inputs, spool);
  OutputFile file(output, spool_directory(*this));
  CompressRun run;
  run.sizes = compress_mesh(*mesh, file.sink(), how, spool);
  file.commit();
  line.wipe();
  run.input = inputs.front();
  run.output = output;
  for (const std::string& path : inputs) run.input_bytes += file_bytes(path);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (json)
    std::fputs(compress_json(run, mesh->info()).c_str(), stdout);
  else
    print(*this, compress_text(run, mesh->info()));
  return kDone;
}

ExitCode JoinCommand::run() {
  CompressOptions how;
  how.order = order_of(order);
  how.level = level_of(level);
  how.threads = threads;
  ProgressLine line(*this);
  how.progress = line.callback();
  if (merge) return write_merged(how, line);
  OutputFile archive(output, spool_directory(*this));
  ByteSink& sink = archive.sink();
  const auto members = join_files(inputs, sink, how, spool_directory(*this), spool_memory(*this),
                                  mesh_limits(*this));
  archive.commit();
  line.wipe();
  const std::uint64_t bytes = file_bytes(output);
  if (json)
    std::fputs(join_json(output, bytes, members).c_str(), stdout);
  else
    print(*this, join_text(output, bytes, members));
  return kDone;
}

}  // namespace shm::converters
