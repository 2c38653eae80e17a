// shm: the tool. Each command is one function from options to an exit code; everything that goes
// wrong is thrown as a Failure and said once, here.
// Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,
// 4 output could not be written, 5 a limit was exceeded, 6 the output would lack something
// (--strict), 7 repair salvaged a part.
#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "archive/archive_files.h"
#include "archive/parity.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "compare/compare.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "formats/formats.h"
#include "order/cell_order_file.h"
#include "tool/append_command.h"
#include "tool/archive_commands.h"
#include "tool/diff_command.h"
#include "tool/extract_command.h"
#include "tool/input.h"
#include "tool/layout.h"
#include "tool/options.h"
#include "tool/repair_command.h"
#include "tool/report.h"
#include "tool/support.h"
#include "transfer/translate.h"

#ifndef SHM_VERSION
#define SHM_VERSION "0.9.0"
#endif

namespace shm::converters {
namespace {

SizeReport compress_to_pipe(MeshSource& mesh, const CompressOptions& how, Spool& spool) {
  const auto sink = unwrap(FileSink::create("-"), "-");
  const SizeReport sizes = compress_mesh(mesh, *sink, how, spool);
  unwrap(sink->commit(), "-");
  return sizes;
}

SizeReport compress_to_file(MeshSource& mesh, const Options& options, const CompressOptions& how,
                            Spool& spool) {
  OutputFile output(options.output, spool_directory(options));
  FileSink& sink = output.sink();
  SizeReport sizes = compress_mesh(mesh, sink, how, spool);
  if (options.parity) {
    const std::uint64_t bytes = protect(sink, options.output, *options.parity / 100, how.progress);
    sizes.streams["parity"] = bytes;
    sizes.total_bytes += bytes;
  }
  output.commit();
  return sizes;
}

// Tells on standard error when order and numbers that nobody may need are much of the file. Looks
// only at what is dear and has many vertices waiting for their last use; closer, by a trial, where
// the mesh is small enough for that.
void hint_at_free_order(MeshSource& mesh, const CompressOptions& how, const CompressRun& run,
                        Spool& spool) {
  constexpr double kDearBits = 6;
  constexpr std::uint64_t kMostCells = 1 << 19, kFewestBytes = 1 << 16;
  const SizeReport& sizes = run.sizes;
  if (how.order != Order::keep || bits_a_cell(sizes) < kDearBits ||
      sizes.max_active_vertices < sizes.vertices / 16 || sizes.total_bytes < kFewestBytes)
    return;
  std::optional<std::uint64_t> free_bytes;
  if (sizes.cells <= kMostCells) free_bytes = bytes_in_free_order(mesh, how, sizes, spool);
  std::fputs(free_order_hint(run, free_bytes).c_str(), stderr);
}

ExitCode run_compress(Options& options) {
  if (options.output.empty()) options.output = options.input == "-" ? "-" : options.input + ".shm";
  if (options.output == "-" && options.json)
    wrong_use("--json and the compressed mesh cannot both go to standard output");
  if (!options.cell_order.empty() && options.order != "free")
    wrong_use("--cell-order is for --order free");
  if (options.parity && !has_parity_codes())
    wrong_use("--parity: this shm was built without ISA-L, which makes it");
  CompressOptions how = compress_options(options);
  const auto start = std::chrono::steady_clock::now();
  ProgressLine line(options.quiet);
  // An incoherent mesh is read in any order: pages that go to disk would come back soon.
  Spool spool(spool_directory(options), spool_memory(options, options.order == "free"));
  line.show("reading " + options.input);
  ToolInput input(options);
  const auto mesh = input.open(spool, line.callback());

  how.progress = line.callback();
  std::optional<CellSequence> cell_order;
  if (!options.cell_order.empty())
    how.cell_order = &cell_order.emplace(read_cell_order(options.cell_order, mesh->info().cells()));
  CompressRun run;
  run.input = options.input;
  run.output = options.output;
  run.input_bytes = file_bytes(input.path());
  run.sizes = options.output == "-" && !options.parity
                  ? compress_to_pipe(*mesh, how, spool)
                  : compress_to_file(*mesh, options, how, spool);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  line.wipe();
  if (options.json)
    std::fputs(compress_json(run, mesh->info()).c_str(), stdout);
  else
    say(options, compress_text(run, mesh->info()));
  if (!options.json && !options.quiet) hint_at_free_order(*mesh, how, run, spool);
  return kDone;
}

ExitCode run_convert(Options& options, ToolInput& input) {
  const Format& format = output_format(options.output, options.format);
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options), spool_memory(options));
  line.show("reading " + options.input);
  const auto mesh = input.open(spool, line.callback(), options.threads);
  std::optional<Translation> translation;
  if (is_foreign(mesh->info(), format)) {
    translation.emplace(*mesh, std::string(format.name), *format.holds, options.step, spool);
  } else if (options.step) {
    wrong_use("--step is for a mesh from another format than that of OUT");
  }
  MeshSource& written = translation ? translation->mesh() : *mesh;
  if (translation && !translation->losses().empty()) {
    line.wipe();
    tell_losses(translation->losses(), options.output);
    if (options.strict) return kIncomplete;
  }
  line.show("writing " + options.output);
  write_mesh(written, options.output, format, spool);
  line.wipe();
  say(options, options.output + ": " + counts_text(written.info()) + "\n");
  return kDone;
}

ExitCode run_convert(Options& options) {
  output_format(options.output, options.format);  // wrong use comes before bad input
  ToolInput input(options);
  return run_convert(options, input);
}

ExitCode run_decompress(Options& options) {
  output_format(options.output, options.format);
  ToolInput input(options);
  input.require_shm();
  return run_convert(options, input);
}

ExitCode run_verify(Options& options) {
  if (!options.cell_order.empty() && options.against.empty())
    wrong_use("--cell-order tells how --against is to be compared");
  ToolInput input(options);
  if (!input.is_stream() && is_archive(input.path())) {
    options.input = input.path();
    return verify_archive(options);
  }
  input.require_shm();
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options), spool_memory(options));
  std::unique_ptr<MeshSource> restored;
  try {
    restored = input.open(spool, line.callback(), options.threads);
  } catch (const Failure& failure) {
    if (input.is_stream()) throw;
    line.wipe();
    fail_with_damage(failure, input.path(), options);
  }
  if (options.against.empty()) {
    const ParityState parity =
        input.is_stream() ? ParityState() : parity_state(input.path(), line.callback());
    line.wipe();
    if (options.json)
      std::fputs(sound_json(options.input, restored->info(), parity).c_str(), stdout);
    else
      say(options,
          options.input + ": sound, " + counts_text(restored->info()) + parity_text(parity) + "\n");
    return parity.sound() ? kDone : kBadInput;
  }
  line.show("reading " + options.against);
  const auto source = open_mesh(options.against, spool, line.callback());
  std::optional<CellSequence> cell_order;
  if (!options.cell_order.empty())
    cell_order = read_cell_order(options.cell_order, source->info().cells());
  const CompareReport report = compare_meshes(*source, *restored, spool, line.callback(),
                                              cell_order ? &*cell_order : nullptr);
  line.wipe();
  if (options.json)
    std::fputs(compare_json(report, options.against, options.input, restored->info()).c_str(),
               stdout);
  else
    say(options, compare_text(report, options.against, options.input));
  return report.equal() ? kDone : kDifferent;
}

ExitCode run_diff(Options& options) {
  options.input = options.diff.a;
  ProgressLine line(options.quiet);
  // With --match, places and values are read in any order.
  Spool spool(spool_directory(options), spool_memory(options, options.diff.match));
  line.show("reading " + options.diff.a);
  const DiffCommand::Outcome outcome = options.diff.run(spool, line.callback());
  line.wipe();
  if (options.diff.json)
    std::fputs(outcome.text.c_str(), stdout);
  else
    say(options, outcome.text);
  return outcome.equal ? kDone : kDifferent;
}

ExitCode run_info(Options& options) {
  ProgressLine line(options.quiet);
  std::string text;
  ToolInput input(options);
  if (!input.is_stream() && is_archive(input.path())) {
    ArchiveFile archive(input.path());
    std::vector<MemberSummary> members;
    for (const ArchiveMember& member : archive.members())
      members.push_back({member.name, archive.summarize(member)});
    text = (options.json ? archive_json : archive_text)(options.input, members);
  } else if (input.is_shm()) {
    const FileSummary summary = input.summarize(line.callback());
    text = (options.json ? info_json : info_text)(options.input, summary.info, &summary.totals);
  } else {
    Spool spool(spool_directory(options), spool_memory(options));
    const auto mesh = input.open(spool, line.callback());
    text = (options.json ? info_json : info_text)(options.input, mesh->info(), nullptr);
  }
  line.wipe();
  std::fputs(text.c_str(), stdout);
  return kDone;
}

ExitCode run_layout(Options& options) {
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options), spool_memory(options));
  line.show("reading " + options.input);
  const auto mesh = open_mesh(options.input, spool, line.callback());
  const Layout layout = measure_layout(*mesh, spool, line.callback());
  const std::string svg =
      layout_svg(layout, std::filesystem::path(options.input).filename().string());
  OutputFile output(options.output);
  output.write(std::as_bytes(std::span(svg)));
  output.commit();
  line.wipe();
  say(options, options.output + ": width " + std::to_string(layout.width) + " of " +
                   std::to_string(layout.vertices) + " vertices, " + std::to_string(layout.cells) +
                   " cells\n");
  return kDone;
}

struct Command {
  CLI::App* app;
  ExitCode (*run)(Options&);
};

int run(int argc, char** argv, Options& options) {
  CLI::App app{"shm compresses hexahedral meshes with their data and gives them back."};
  app.name("shm");
  app.set_version_flag("--version", "shm " SHM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "shm COMMAND --help tells more and gives examples.\n"
      "Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,\n"
      "4 output could not be written, 5 a limit was exceeded, 6 the output would lack something\n"
      "of the mesh (--strict), 7 repair salvaged what is whole, and something is missing.");
  const Command commands[] = {
      {add_compress(app, options), run_compress}, {add_decompress(app, options), run_decompress},
      {add_append(app, options), run_append},     {add_convert(app, options), run_convert},
      {add_verify(app, options), run_verify},     {add_diff(app, options), run_diff},
      {add_info(app, options), run_info},         {add_join(app, options), run_join},
      {add_split(app, options), run_split},       {add_extract(app, options), run_extract},
      {add_layout(app, options), run_layout},     {add_repair(app, options), run_repair},
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // help, version
    std::fprintf(stderr, "shm: %s (see shm --help)\n", error.what());
    return kWrongUse;
  }
  for (const Command& command : commands)
    if (command.app->parsed()) return command.run(options);
  return kWrongUse;
}

// Whether standard output is a pipe that nobody reads any more: `shm info x | head` is no mistake.
bool nobody_listens() {
  struct pollfd out = {STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

int complain(int code, const std::string& sentence) {
  if (code == kBadOutput && nobody_listens()) return code;
  std::fprintf(stderr, "shm: %s\n", sentence.c_str());
  return code;
}

int guarded_run(int argc, char** argv) {
  Options options;
  try {
    const int code = run(argc, argv, options);
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    return complain(kBadOutput, "standard output cannot be written");
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (!options.spooled.empty() && error.file == options.spooled) error.file = "-";
    if (error.file.empty() && error.code != ErrorCode::misuse) error.file = options.input;
    return complain(exit_code(error.code), error.message());
  } catch (const std::bad_alloc&) {
    return complain(kLimit, options.input + ": needs more memory than there is");
  } catch (const std::length_error&) {
    return complain(kLimit, options.input + ": needs more memory than there is");
  } catch (const std::exception& error) {
    return complain(kBadInput, options.input + ": " + error.what());
  }
}

}  // namespace
}  // namespace shm::converters

int main(int argc, char** argv) {
  // What large arrays leave goes back to the system, and is not kept for smaller ones to come.
  ::mallopt(M_MMAP_THRESHOLD, 768 * 1024);
  shm::converters::remove_outputs_on_signals();
  std::signal(SIGPIPE, SIG_IGN);  // who writes to a pipe that is closed hears of it
  return shm::converters::guarded_run(argc, argv);
}
