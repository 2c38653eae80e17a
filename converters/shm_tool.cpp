// shm: the tool. Each command is one function from options to an exit code; everything that goes
// wrong is thrown as a Failure and said once, here.
// Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,
// 4 output could not be written, 5 a limit was exceeded, 6 the output would lack something
// (--strict).
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "archive_files.h"
#include "cell_order_file.h"
#include "compare.h"
#include "compress.h"
#include "decompress.h"
#include "diff_command.h"
#include "failure.h"
#include "formats.h"
#include "layout.h"
#include "output_file.h"
#include "report.h"
#include "translate.h"

#ifndef SHM_VERSION
#define SHM_VERSION "0.1.0"
#endif

namespace shm::converters {
namespace {

enum ExitCode {
  kDone = 0,
  kDifferent = 1,
  kWrongUse = 2,
  kBadInput = 3,
  kBadOutput = 4,
  kLimit = 5,
  kIncomplete = 6
};

// Memory of the spool.
constexpr std::size_t kSpool = std::size_t{64} << 20, kFreeOrderSpool = std::size_t{1} << 30;

struct Options {
  std::string input, output, format, against, temp, cell_order, directory = ".";
  std::vector<std::string> inputs, members;
  std::string order = "keep";
  std::optional<std::uint32_t> delay;  // none told: as a trial finds
  std::uint32_t bits = 0;
  std::optional<std::string> abs, rel;
  std::vector<std::string> arrays;  // NAME:ACCURACY
  std::string level = "default", codec = "auto";
  std::uint64_t segment_cells = 0;
  double restart_budget = .2;  // percent
  std::uint32_t key_steps = 8;
  unsigned threads = 0;  // one for each core
  std::optional<std::uint64_t> step;
  bool json = false, quiet = false, packed = false, strict = false;
  DiffCommand diff;
};

ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::misuse: return kWrongUse;
    case ErrorCode::output: return kBadOutput;
    case ErrorCode::over_limit: return kLimit;
    case ErrorCode::io:
    case ErrorCode::truncated:
    case ErrorCode::corrupt:
    case ErrorCode::unsupported: return kBadInput;
  }
  return kBadInput;
}

// One line on the terminal, rewritten at most ten times a second and wiped at the end.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : shown_(!quiet && ::isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() { wipe(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  Progress callback() {
    if (!shown_) return {};
    return [this](std::string_view phase, std::uint64_t done, std::uint64_t total) {
      show(phase, done, total);
    };
  }
  void show(std::string_view phase, std::uint64_t done = 0, std::uint64_t total = 0) {
    const auto now = std::chrono::steady_clock::now();
    if (!shown_ || (now - last_ < std::chrono::milliseconds(100) && total != 0)) return;
    last_ = now;
    dirty_ = true;
    std::fprintf(stderr, "\r\033[K%.*s", static_cast<int>(phase.size()), phase.data());
    if (total > 0)
      std::fprintf(stderr, " %3.0f %%",
                   100.0 * static_cast<double>(done) / static_cast<double>(total));
  }
  void wipe() {
    if (dirty_) std::fputs("\r\033[K", stderr);
    dirty_ = false;
  }

 private:
  bool shown_, dirty_ = false;
  std::chrono::steady_clock::time_point last_{};
};

// Spools go beside the output, which has room for meshes, or where the user says.
std::string spool_directory(const Options& options) {
  if (!options.temp.empty()) return options.temp;
  if (options.output.empty() || options.output == "-")
    return std::filesystem::temp_directory_path().string();
  const std::filesystem::path parent = std::filesystem::path(options.output).parent_path();
  return parent.empty() ? "." : parent.string();
}

std::uint64_t file_bytes(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

void say(const Options& options, const std::string& text) {
  if (!options.quiet) std::fputs(text.c_str(), options.output == "-" ? stderr : stdout);
}

[[noreturn]] void wrong_use(const std::string& sentence) {
  throw Failure(Error{ErrorCode::misuse, sentence, {}, kNoOffset, {}});
}

SizeReport compress_to_standard_output(MeshSource& mesh, const CompressOptions& how, Spool& spool) {
  const auto sink = unwrap(FileSink::create("-"), "-");
  const SizeReport sizes = compress_mesh(mesh, *sink, how, spool);
  unwrap(sink->commit(), "-");
  return sizes;
}

SizeReport compress_to_file(MeshSource& mesh, const std::string& path, const CompressOptions& how,
                            Spool& spool) {
  OutputFile output(path);
  OutputSink sink(output);
  const SizeReport sizes = compress_mesh(mesh, sink, how, spool);
  output.commit();
  return sizes;
}

Order order_of(const std::string& name) {
  for (const Order order : {Order::stream, Order::free})
    if (name == order_name(order)) return order;
  return Order::keep;
}

Level level_of(const std::string& name) {
  return name == "fast" ? Level::fast : name == "best" ? Level::best : Level::standard;
}

ConnectivityCodec codec_of(const std::string& name) {
  for (const auto codec :
       {ConnectivityCodec::paper, ConnectivityCodec::rows, ConnectivityCodec::replay,
        ConnectivityCodec::mixed, ConnectivityCodec::shifts})
    if (name == codec_name(codec)) return codec;
  return ConnectivityCodec::automatic;
}

// --array beats the others; for coordinates --bits beats --abs and --rel.
Lossy lossy_of(const Options& options) {
  if (options.abs && options.rel) wrong_use("--abs and --rel exclude each other");
  Lossy lossy;
  if (options.abs) lossy.fields = parse_accuracy("abs=" + *options.abs, "--abs");
  if (options.rel) lossy.fields = parse_accuracy("rel=" + *options.rel, "--rel");
  lossy.coordinates = options.bits > 0 ? Accuracy::of_bits(options.bits) : lossy.fields;
  for (const std::string& text : options.arrays)
    lossy.named.push_back(parse_named_accuracy(text, "--array"));
  return lossy;
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
  if (options.output.empty()) options.output = options.input + ".shm";
  if (options.output == "-" && options.json)
    wrong_use("--json and the compressed mesh cannot both go to standard output");
  if (!(options.restart_budget >= 0)) wrong_use("--restart-budget is no number");
  if (options.delay.value_or(0) > 0 && options.order == "free")
    wrong_use("--delay is for the order stream; --order free moves cells anyway");
  if (!options.cell_order.empty() && options.order != "free")
    wrong_use("--cell-order is for --order free");
  CompressOptions how;
  how.lossy = lossy_of(options);
  const auto start = std::chrono::steady_clock::now();
  ProgressLine line(options.quiet);
  // An incoherent mesh is read in any order: pages that go to disk would come back soon.
  Spool spool(spool_directory(options), options.order == "free" ? kFreeOrderSpool : kSpool);
  line.show("reading " + options.input);
  const auto mesh = open_mesh(options.input, spool, line.callback());

  how.order = order_of(options.order);
  how.delay = options.delay;
  how.level = level_of(options.level);
  how.connectivity = codec_of(options.codec);
  how.segment_cells = options.segment_cells;
  how.restart_budget = options.restart_budget / 100;
  how.key_steps = options.key_steps;
  how.threads = options.threads;
  how.progress = line.callback();
  std::optional<CellSequence> cell_order;
  if (!options.cell_order.empty())
    how.cell_order = &cell_order.emplace(read_cell_order(options.cell_order, mesh->info().cells()));
  CompressRun run;
  run.input = options.input;
  run.output = options.output;
  run.input_bytes = file_bytes(options.input);
  run.sizes = options.output == "-" ? compress_to_standard_output(*mesh, how, spool)
                                    : compress_to_file(*mesh, options.output, how, spool);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  line.wipe();
  if (options.json)
    std::fputs(compress_json(run, mesh->info()).c_str(), stdout);
  else
    say(options, compress_text(run, mesh->info()));
  if (!options.json && !options.quiet) hint_at_free_order(*mesh, how, run, spool);
  return kDone;
}

bool is_shm(const std::string& path) {
  const Format* format = format_of_file(path);
  return format != nullptr && format->name == "shm";
}

std::unique_ptr<MeshSource> open_input(const Options& options, Spool& spool, ProgressLine& line) {
  return is_shm(options.input) ? open_shm(options.input, spool, line.callback(), options.threads)
                               : open_mesh(options.input, spool, line.callback());
}

// Whatever --quiet says: nothing goes silently.
void tell_losses(const LossList& losses, const std::string& output) {
  for (const std::string& loss : losses)
    std::fprintf(stderr, "shm: not in %s: %s\n", output.c_str(), loss.c_str());
}

ExitCode run_convert(Options& options) {
  const Format& format = output_format(options.output, options.format);
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options));
  line.show("reading " + options.input);
  const auto mesh = open_input(options, spool, line);
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

void require_shm(const std::string& path) {
  if (is_archive(path))
    throw Failure(Error{ErrorCode::unsupported,
                        "is an archive of several files; shm split gives them back",
                        {},
                        kNoOffset,
                        path});
  if (!is_shm(path))
    throw Failure(Error{ErrorCode::unsupported, "is not a .shm file", {}, kNoOffset, path});
}

ExitCode run_decompress(Options& options) {
  output_format(options.output, options.format);  // wrong use comes before bad input
  require_shm(options.input);
  return run_convert(options);
}

// The file that a member was made of, in the directory --against.
std::string source_of_member(const ArchiveMember& member, const std::string& directory) {
  const std::filesystem::path path = std::filesystem::path(directory) / member.name;
  return was_packed(member) && !std::filesystem::exists(path)
             ? std::filesystem::path(path).replace_extension().string()
             : path.string();
}

// Each member as a file of its own; --against names the directory of their sources.
ExitCode verify_archive(const Options& options) {
  if (!options.against.empty() && !std::filesystem::is_directory(options.against))
    wrong_use("--against of an archive is the directory of the files that it was made of");
  if (!options.cell_order.empty()) wrong_use("--cell-order is not for archives");
  ArchiveFile archive(options.input);
  ExitCode code = kDone;
  for (const ArchiveMember& member : archive.members()) {
    ProgressLine line(options.quiet);
    Spool spool(spool_directory(options));
    const auto restored = archive.open(member, spool, line.callback(), options.threads);
    const std::string place = archive.place(member);
    if (options.against.empty()) {
      line.wipe();
      if (options.json)
        std::fputs(sound_json(place, restored->info()).c_str(), stdout);
      else
        say(options, place + ": sound, " + counts_text(restored->info()) + "\n");
      continue;
    }
    const std::string against = source_of_member(member, options.against);
    const auto source = open_mesh(against, spool, line.callback());
    const CompareReport report = compare_meshes(*source, *restored, spool, line.callback());
    line.wipe();
    if (options.json)
      std::fputs(compare_json(report, against, place, restored->info()).c_str(), stdout);
    else
      say(options, compare_text(report, against, place));
    if (!report.equal()) code = kDifferent;
  }
  return code;
}

ExitCode run_verify(Options& options) {
  if (!options.cell_order.empty() && options.against.empty())
    wrong_use("--cell-order tells how --against is to be compared");
  if (is_archive(options.input)) return verify_archive(options);
  require_shm(options.input);
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options));
  const auto restored = open_shm(options.input, spool, line.callback(), options.threads);
  if (options.against.empty()) {
    line.wipe();
    if (options.json)
      std::fputs(sound_json(options.input, restored->info()).c_str(), stdout);
    else
      say(options, options.input + ": sound, " + counts_text(restored->info()) + "\n");
    return kDone;
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
  Spool spool(spool_directory(options), options.diff.match ? kFreeOrderSpool : kSpool);
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
  if (is_archive(options.input)) {
    ArchiveFile archive(options.input);
    std::vector<MemberSummary> members;
    for (const ArchiveMember& member : archive.members())
      members.push_back({member.name, archive.summarize(member, line.callback())});
    text = (options.json ? archive_json : archive_text)(options.input, members);
  } else if (is_shm(options.input)) {
    const FileSummary summary = summarize_shm(options.input, line.callback());
    text = (options.json ? info_json : info_text)(options.input, summary.info, &summary.totals);
  } else {
    Spool spool(spool_directory(options));
    const auto mesh = open_mesh(options.input, spool, line.callback());
    text = (options.json ? info_json : info_text)(options.input, mesh->info(), nullptr);
  }
  line.wipe();
  std::fputs(text.c_str(), stdout);
  return kDone;
}

ExitCode run_join(Options& options) {
  CompressOptions how;
  how.order = order_of(options.order);
  how.level = level_of(options.level);
  how.threads = options.threads;
  ProgressLine line(options.quiet);
  how.progress = line.callback();
  OutputFile output(options.output);
  OutputSink sink(output);
  const auto members = join_files(options.inputs, sink, how, spool_directory(options));
  output.commit();
  line.wipe();
  const std::uint64_t bytes = file_bytes(options.output);
  if (options.json)
    std::fputs(join_json(options.output, bytes, members).c_str(), stdout);
  else
    say(options, join_text(options.output, bytes, members));
  return kDone;
}

ExitCode run_split(Options& options) {
  ArchiveFile archive(options.input);
  std::vector<ArchiveMember> wanted;
  for (const std::string& name : options.members) wanted.push_back(archive.find(name));
  if (wanted.empty()) wanted = archive.members();
  for (const ArchiveMember& member : wanted) {
    ProgressLine line(options.quiet);
    line.show("writing " + member.name);
    std::string path = (std::filesystem::path(options.directory) / member.name).string();
    if (options.packed || was_packed(member)) {
      if (!was_packed(member)) path += ".shm";
      archive.copy(member, path);
    } else {
      Spool spool(options.temp.empty() ? options.directory : options.temp);
      archive.restore(member, path, spool, line.callback(), options.threads);
    }
    line.wipe();
    say(options, path + "\n");
  }
  return kDone;
}

ExitCode run_layout(Options& options) {
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options));
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

CLI::App* add_command(CLI::App& app, Options& options, const std::string& name,
                      const std::string& description, const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("Examples:\n" + examples);
  command->add_option("--temp", options.temp, "Directory for temporary files")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command->add_flag("-q,--quiet", options.quiet, "No progress, and no summary at the end");
  return command;
}

void add_threads(CLI::App& command, Options& options, const std::string& what) {
  command.add_option("--threads", options.threads, what + " with N threads (default: one a core)")
      ->check(CLI::Range(1u, 1024u).description(""))
      ->type_name("N");
}

void add_order_and_level(CLI::App& command, Options& options) {
  command
      .add_option("--order", options.order,
                  "keep: all numbers come back (default); stream: vertices numbered by first use;\n"
                  "free: the same mesh, its cells in whatever order is smallest (needs memory)")
      ->check(CLI::IsMember({"keep", "stream", "free"}).description(""))
      ->type_name("keep|stream|free");
  command
      .add_option("--level", options.level,
                  "fast: little work for each cell; default; best: the smallest file, slower")
      ->check(CLI::IsMember({"fast", "default", "best"}).description(""))
      ->type_name("fast|default|best");
}

CLI::App* add_compress(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "compress", "Compress a mesh with all its data into a .shm file",
      "  shm compress rotor.e                     writes rotor.e.shm, gives back all as it was\n"
      "  shm compress part.vtk -o part.shm --json sizes of all streams for a program\n"
      "  shm compress part.msh --order stream --delay 100\n"
      "                                           smaller: vertices renumbered, cells reordered\n"
      "  shm compress part.e --order free         the same mesh in the order that is smallest\n"
      "  shm compress scan.vtk --bits 16          coordinates rounded to 16 bits of the box\n"
      "  shm compress flow.e --rel 1e-4           coordinates and fields within 1e-4 of their "
      "range\n"
      "  shm compress flow.e --abs 1e-6 --array coordinates:lossless --array point/T:abs=0.01");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write (default: IN.shm)")
      ->type_name("OUT.shm");
  add_order_and_level(*command, options);
  command
      ->add_option("--delay", options.delay,
                   "Cells in the delay buffer, 0 for none\n"
                   "(default: none; in --order stream what a trial on a sample finds smaller)")
      ->check(CLI::Range(0u, 1u << 20).description(""))
      ->type_name("N");
  command
      ->add_option("--cell-order", options.cell_order,
                   "For --order free: the cells in the order of this file, a number from 0 in each "
                   "line,\ninstead of a search; verify needs the file too")
      ->type_name("FILE");
  command
      ->add_option("--bits", options.bits, "Round coordinates to N bits of the bounding box, 1..52")
      ->check(CLI::Range(1u, 52u).description(""))
      ->type_name("N");
  command
      ->add_option("--abs", options.abs,
                   "Round coordinates and all floating-point fields; no finite value moves by more "
                   "than E,\nand what is not finite stays (--bits, if given, is for coordinates)")
      ->type_name("E");
  command
      ->add_option("--rel", options.rel,
                   "The same, with a bound for each array: E times its range over all components, "
                   "blocks and\nsteps; for coordinates the largest side of their box")
      ->type_name("E");
  command
      ->add_option("--array", options.arrays,
                   "For one array, whatever the options above say: NAME:abs=E, NAME:rel=E, "
                   "NAME:bits=N or\nNAME:lossless; NAME is coordinates or an array's, as "
                   "point/NAME or cell/NAME where there are\nseveral. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME:HOW");
  command
      ->add_option(
          "--codec", options.codec,
          "Connectivity: auto, what the level tries (default); paper, the published scheme; rows; "
          "replay, fast on regular layouts; mixed, smallest, half as fast as rows; shifts, many "
          "times faster\nwhere numbers run in rows and layers, coordinates and arrays too, which "
          "take "
          "more room (order keep,\nno delay, no time steps)")
      ->check(CLI::IsMember({"auto", "paper", "rows", "replay", "mixed", "shifts"}).description(""))
      ->type_name("auto|paper|rows|replay|mixed|shifts");
  command
      ->add_option("--segment-cells", options.segment_cells,
                   "Start afresh every N cells, for random access and threads (default: by budget)")
      ->check(CLI::Range(std::uint64_t{1}, ~std::uint64_t{0}).description(""))
      ->type_name("N");
  command
      ->add_option("--restart-budget", options.restart_budget,
                   "Start afresh where at most P percent of the vertices have to be said again\n"
                   "(default: 0.2; 0: never)")
      ->check(CLI::Range(0.0, 100.0).description(""))
      ->type_name("P");
  command
      ->add_option("--key-steps", options.key_steps,
                   "Of N time steps in turn at least one refers to no other, so that reading can\n"
                   "begin there (default: 8; 1: all)")
      ->check(CLI::Range(std::uint32_t{1}, ~std::uint32_t{0}).description(""))
      ->type_name("N");
  add_threads(*command, options, "Encode segments");
  command->add_flag("--json", options.json, "Print the sizes as JSON");
  return command;
}

// What another format than the mesh's own cannot hold.
void add_translation(CLI::App& command, Options& options) {
  command.add_flag("--strict", options.strict,
                   "Write nothing when OUT, of another format than the mesh came from, would lack "
                   "something\n(which is named on standard error in any case): exit code 6");
  command
      .add_option("--step", options.step,
                  "Of a mesh that goes to another format: time step N alone, from 0 (default: all; "
                  "the last\nwhere a file holds one)")
      ->type_name("N");
}

CLI::App* add_decompress(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "decompress", "Write the mesh of a .shm file in another format",
                  "  shm decompress rotor.e.shm -o rotor.e\n"
                  "  shm decompress part.shm -o part.out --format vtk");
  command->add_option("IN", options.input, ".shm file, - for standard input")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write")->required()->type_name("OUT");
  command->add_option("--format", options.format, "exodus, vtk, gmsh or shm; default: by name")
      ->type_name("F");
  add_translation(*command, options);
  add_threads(*command, options, "Decode segments");
  return command;
}

CLI::App* add_convert(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "convert", "Write a mesh of any known format in another one",
                  "  shm convert part.msh part.e\n"
                  "  shm convert part.e part.dat --format vtk");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("OUT", options.output, "File to write")->required()->type_name("");
  command->add_option("--format", options.format, "exodus, vtk, gmsh or shm; default: by name")
      ->type_name("F");
  add_translation(*command, options);
  return command;
}

CLI::App* add_verify(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "verify",
                  "Decode all of a .shm file; with --against, prove that it holds the same mesh;\n"
                  "of what was rounded, tell the largest error, and prove that it keeps its bound",
                  "  shm verify rotor.e.shm\n"
                  "  shm verify rotor.e.shm --against rotor.e   exit code 1 when they differ");
  command->add_option("IN", options.input, ".shm file")->required()->type_name("");
  add_threads(*command, options, "Decode segments");
  command->add_option("--against", options.against, "Mesh that IN was made of")
      ->type_name("SOURCE");
  command
      ->add_option("--cell-order", options.cell_order,
                   "The file with which IN was made in --order free")
      ->type_name("FILE");
  command->add_flag(
      "--json", options.json,
      "Print as JSON whether they are equal, how many differences there are, and counts");
  return command;
}

CLI::App* add_diff(CLI::App& app, Options& options) {
  CLI::App* command = add_command(app, options, "diff", kDiffDescription, kDiffExamples);
  options.diff.add_options(*command);
  return command;
}

CLI::App* add_info(CLI::App& app, Options& options) {
  CLI::App* command = add_command(app, options, "info",
                                  "Tell what a mesh holds and where the bytes of a .shm file go",
                                  "  shm info rotor.e.shm\n"
                                  "  shm info rotor.e.shm --json | jq .streams");
  command->add_option("IN", options.input, ".shm file (or any mesh, without sizes)")
      ->required()
      ->type_name("");
  command->add_flag("--json", options.json, "Print as JSON");
  return command;
}

CLI::App* add_layout(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "layout",
      "Draw how coherently a mesh is stored: vertices down, cells across, a green line\n"
      "from the first to the last use of each vertex",
      "  shm layout rotor.e -o rotor.svg");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "Picture to write")
      ->required()
      ->type_name("OUT.svg");
  return command;
}

CLI::App* add_join(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "join",
      "Put several meshes into one .shm file: the pieces of a decomposed mesh, the files of a\n"
      "restarted run. .shm files go in as they are, others are compressed",
      "  shm join -o rotor.shm rotor.e.4.0 rotor.e.4.1 rotor.e.4.2 rotor.e.4.3\n"
      "  shm join -o run.shm run.e run.e-s002 run.e-s003\n"
      "  shm join -o rounded.shm a.e.shm b.e.shm     made by shm compress, with its options");
  command->add_option("IN", options.inputs, "Exodus, VTK legacy, Gmsh or .shm files")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write")
      ->required()
      ->type_name("OUT.shm");
  add_order_and_level(*command, options);
  add_threads(*command, options, "Encode segments");
  command->add_flag("--json", options.json, "Print the sizes as JSON");
  return command;
}

CLI::App* add_split(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "split",
                  "Give back the files of which shm join made an archive, each in its own format",
                  "  shm split rotor.shm -d pieces\n"
                  "  shm split run.shm run.e-s002               only this one, here\n"
                  "  shm split run.shm --packed                 .shm files, one for each");
  command->add_option("IN", options.input, "Archive that shm join made")->required()->type_name("");
  command->add_option("NAME", options.members, "Members to give back; default: all")->type_name("");
  command->add_option("-d,--directory", options.directory, "Directory to write to; default: here")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command->add_flag("--packed", options.packed, "As .shm files, without decompressing");
  add_threads(*command, options, "Decode segments");
  return command;
}

int run(int argc, char** argv, Options& options) {
  CLI::App app{"shm compresses hexahedral meshes with their data and gives them back."};
  app.name("shm");
  app.set_version_flag("--version", "shm " SHM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "shm COMMAND --help tells more and gives examples.\n"
      "Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,\n"
      "4 output could not be written, 5 a limit was exceeded, 6 the output would lack something\n"
      "of the mesh (--strict).");
  const Command commands[] = {
      {add_compress(app, options), run_compress}, {add_decompress(app, options), run_decompress},
      {add_convert(app, options), run_convert},   {add_verify(app, options), run_verify},
      {add_diff(app, options), run_diff},         {add_info(app, options), run_info},
      {add_join(app, options), run_join},         {add_split(app, options), run_split},
      {add_layout(app, options), run_layout},
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

int complain(int code, const std::string& sentence) {
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
  shm::converters::remove_outputs_on_signals();
  return shm::converters::guarded_run(argc, argv);
}
