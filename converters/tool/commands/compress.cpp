#include "tool/commands/compress.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "archive/parity.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "base/text_input.h"
#include "base/unpacked.h"
#include "order/cell_order_file.h"
#include "series/open_series.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/removal.h"
#include "tool/report.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

// Parses a percentage such as "5%" or "5". It must be above 0 and at most 100.
double percent_of(const std::string& text) {
  double percent = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, percent);
  if (error != std::errc() || (rest != end && (*rest != '%' || rest + 1 != end)) ||
      !(percent > 0 && percent <= 100))
    throw CLI::ValidationError("--parity",
                               "'" + text + "' is not a percentage above 0 and up to 100%");
  return percent;
}

// Prints a hint on standard error that --order free may make the file much smaller. Prints nothing
// unless connectivity needs many bits per cell and the mesh has many active vertices. If the mesh
// is small enough, a trial measures the saving, except at level fast, where the trial would take
// longer than the compression.
void hint_at_free_order(MeshSource& mesh, const CompressOptions& how, const CompressRun& run,
                        Spool& spool) {
  constexpr double kDearBits = 6;
  constexpr std::uint64_t kMostCells = 1 << 19, kFewestBytes = 1 << 16;
  const SizeReport& sizes = run.sizes;
  if (how.order != Order::keep || bits_a_cell(sizes) < kDearBits ||
      sizes.max_active_vertices < sizes.vertices / 16 || sizes.total_bytes < kFewestBytes)
    return;
  std::optional<std::uint64_t> free_bytes;
  if (how.level != Level::fast && sizes.cells <= kMostCells)
    free_bytes = bytes_in_free_order(mesh, how, sizes, spool);
  std::fputs(free_order_hint(run, free_bytes).c_str(), stderr);
}

}  // namespace

CLI::App* CompressCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "compress", "Compress a mesh with all its data into a .shm file",
      "  shm compress rotor.e                     writes rotor.e.shm, without loss of data\n"
      "  shm compress -r runs --rm                each mesh in folder runs and its subfolders;\n"
      "                                           removes a source after its .shm file was read\n"
      "                                           back and found to contain the same mesh\n"
      "  shm compress 'run_%04d.vtu' -o run.shm   a series with one file per time step\n"
      "  shm compress part.vtk -o part.shm --json prints the sizes of all streams as JSON\n"
      "  shm compress part.msh --order stream --delay 100\n"
      "                                           smaller: vertices renumbered, cells reordered\n"
      "  shm compress part.e --order free         the same mesh in the order that compresses best\n"
      "  shm compress scan.vtk --bits 16          coordinates rounded to 16 bits of the bounding "
      "box\n"
      "  shm compress flow.e --rel 1e-4           coordinates and fields within 1e-4 of their "
      "range\n"
      "  shm compress flow.e --abs 1e-6 --array coordinates:lossless --array point/T:abs=0.01\n"
      "  shm compress flow.e --array stress:abs=100 --array stress@notch:abs=1");
  add_files(*command, *this, mesh_file_text() + ",\nplain or compressed with gzip, xz or zstd");
  add_output(*command, *this, "File to write, or folder for IN.shm (default: IN.shm next to IN)",
             "OUT.shm");
  add_removal(*command, *this);
  add_order(*command, order);
  add_level(*command, level);
  command
      ->add_option(
          "--delay", delay,
          "Hold back up to N cells in a buffer, so that adjacent cells are coded one\n"
          "after another (default: 0, no buffer; with --order stream, a trial on a sample\n"
          "chooses N)")
      ->check(whole_number(0, 1u << 20))
      ->type_name("N");
  command
      ->add_option("--cell-order", cell_order,
                   "With --order free: take the cell order from FILE, one cell number (from 0) per "
                   "line,\ninstead of searching for one; verify --against needs the same FILE")
      ->type_name("FILE");
  command
      ->add_option("--bits", bits,
                   "Round coordinates to N bits (1 to 52) across the bounding box (default: exact)")
      ->check(whole_number(1, 52))
      ->type_name("N");
  command
      ->add_option(
          "--abs", abs,
          "Round coordinates and all floating-point fields except global ones (default: exact). "
          "Finite\nvalues change by at most E, NaN and infinities do not change. --bits takes "
          "precedence for\ncoordinates")
      ->type_name("E");
  command
      ->add_option(
          "--rel", rel,
          "Like --abs, but the bound of an array is E times its range over all components, "
          "blocks and\nsteps, and the bound of coordinates is E times the longest side of the "
          "bounding box")
      ->type_name("E");
  command
      ->add_option(
          "--array", arrays,
          "Accuracy of some arrays, overriding the options above: NAME:abs=E, NAME:rel=E, "
          "NAME:bits=N,\nNAME:lossless, NAME:pwrel=E (relative to each value), NAME:digits=N "
          "(significant digits),\nNAME:rms=E (root mean square of the errors) or NAME:psnr=DB "
          "(decibels).\nNAME:fill=V states a fill value, see --fill. NAME is coordinates or the "
          "name "
          "of an array;\nif several arrays have that name, write LOCATION/NAME, e.g. point/NAME "
          "(locations: point, cell,\nglobal, node_set, side_set, element_set). * and ? match any "
          "characters or one; a\nbackslash before a character removes its special meaning. Exact "
          "names take precedence over\npatterns. NAME@BLOCK:abs=E, NAME@BLOCK:rel=E and "
          "NAME@BLOCK:lossless set the accuracy of cell data\nin one block, by its name or id. May "
          "be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME:HOW");
  command
      ->add_option(
          "--fill", fills,
          "A number that marks missing values in floating-point fields, e.g. 9.97e36. Fill values "
          "are\nrestored exactly, cost few bits, and do not count for --rel. Those that a source "
          "file "
          "states\n(_FillValue, missing_value) are known. May be repeated")
      ->allow_extra_args(false)
      ->type_name("V");
  command
      ->add_option(
          "--codec", codec,
          "Codec of connectivity (default: auto, which chooses the best codec that the level "
          "tries).\npaper is the published scheme. rows predicts each hexahedron from the rows "
          "beside it.\nreplay is fast on regular layouts. mixed makes the smallest files, but is "
          "half as fast as\nrows. shifts is many times faster if vertex numbers run in rows and "
          "layers, "
          "and also codes\ncoordinates and arrays, but files may be larger; it cannot be combined "
          "with --delay.\n"
          "patterns is like shifts, but for any mesh")
      ->check(one_of(codec_names()))
      ->type_name(CLI::detail::join(codec_names(), "|"));
  command
      ->add_option_function<std::string>(
          "--parity", [this](const std::string& text) { parity = percent_of(text); },
          "Append parity of P percent of the file size, e.g. 5% (default: no parity). shm repair\n"
          "can then restore lost bytes anywhere, if they are less than P percent of the file")
      ->type_name("P%");
  command
      ->add_option(
          "--segment-cells", segment_cells,
          "Start a segment every N cells; decoding can begin at any segment, and threads decode\n"
          "segments in parallel (default: --restart-budget determines the segments)")
      ->check(whole_number(1))
      ->type_name("N");
  command
      ->add_option("--restart-budget", restart_budget,
                   "Start new segments only while at most P percent of all vertices are stored "
                   "twice because\n"
                   "two segments use them (default: 0.2). With 0, there is only one segment")
      ->check(CLI::Validator(
          [](const std::string& word) {
            double percent = 0;
            const bool is_number = TextInput::parse(std::string_view(word), percent);
            return is_number && percent >= 0 && percent <= 100
                       ? std::string()
                       : "'" + word + "' is not a number from 0 to 100";
          },
          ""))
      ->type_name("P");
  command
      ->add_option(
          "--key-steps", key_steps,
          "Make at least one of any N consecutive time steps independent of other steps, so that\n"
          "reading can begin there (default: 8; for a mesh with one step: 1). Give 8 for a mesh "
          "with one\n"
          "step if shm append will add more steps")
      ->check(whole_number(1, ~std::uint32_t{0}))
      ->type_name("N");
  command->add_flag("--no-digest", no_digest,
                    "Leave out the digests, by which readers find errors of their decoder that\n"
                    "checksums cannot show");
  command->add_flag("--json", json, "Print the sizes as JSON");
  return command;
}

// Returns the requested accuracies. --array takes precedence over all other options. For
// coordinates, --bits takes precedence over --abs and --rel.
Lossy CompressCommand::lossy() const {
  if (abs && rel) wrong_use("--abs and --rel exclude each other");
  Lossy wanted;
  if (abs) wanted.fields = parse_accuracy("abs=" + *abs, "--abs");
  if (rel) wanted.fields = parse_accuracy("rel=" + *rel, "--rel");
  wanted.coordinates = bits > 0 ? Accuracy::of_bits(bits) : wanted.fields;
  for (const std::string& text : fills) wanted.fills.push_back(parse_fill(text, "--fill"));
  for (const std::string& text : arrays) {
    if (auto fill = parse_named_fill(text, "--array"))
      wanted.named_fills.push_back(std::move(*fill));
    else
      wanted.named.push_back(parse_named_accuracy(text, "--array"));
  }
  return wanted;
}

CompressOptions CompressCommand::how() const {
  if (!(restart_budget >= 0)) wrong_use("--restart-budget must be a number from 0 to 100");
  if (delay.value_or(0) > 0 && order == "free")
    wrong_use("--order free needs --delay 0, since it reorders cells anyway; --delay is " +
              std::to_string(*delay));
  CompressOptions wanted;
  wanted.lossy = lossy();
  wanted.order = order_of(order);
  wanted.delay = delay;
  wanted.level = level_of(level);
  wanted.connectivity = codec_of(codec);
  wanted.segment_cells = segment_cells;
  wanted.restart_budget = restart_budget / 100;
  wanted.key_steps = key_steps;
  wanted.threads = threads;
  wanted.digest = !no_digest;
  return wanted;
}

// Returns the phases of the command for the progress line, each with an estimate of its work. The
// estimate is the size in bytes of the data that the phase processes, multiplied by a factor that
// was measured with a profiler.
std::vector<ExpectedPhase> CompressCommand::phases_of(const MeshInfo& info) const {
  const MeshBytes bytes = bytes_of_mesh(info);
  const double cells = static_cast<double>(bytes.cells);
  std::vector<ExpectedPhase> phases;
  if (order == "free")
    phases = {{"reading cells", .1 * cells},     {"sorting vertices", .1 * cells},
              {"numbering corners", .1 * cells}, {"sorting cells", .1 * cells},
              {"joining faces", .4 * cells},     {"trying orders", .4 * cells}};
  double streamed = 2 * cells + static_cast<double>(bytes.points);
  for (std::size_t a = 0; a < bytes.arrays.size(); ++a)
    if (!info.schema.arrays[a].per_step) streamed += static_cast<double>(bytes.arrays[a]);
  phases.push_back({"finding last uses", .1 * cells});
  phases.push_back({"streaming cells", streamed});
  for (std::size_t a = 0; a < bytes.arrays.size(); ++a)
    if (info.schema.arrays[a].per_step)
      phases.push_back({info.schema.arrays[a].name, static_cast<double>(bytes.arrays[a])});
  const double all = static_cast<double>(bytes.all());
  if (parity) phases.push_back({"writing parity", .05 * all});
  if (remove) {
    phases.push_back({"decoding", .5 * all});
    phases.push_back({"comparing", .2 * all});
  }
  return phases;
}

SizeReport CompressCommand::write_to_pipe(MeshSource& mesh, const CompressOptions& how,
                                          Spool& spool) const {
  const auto sink = unwrap(FileSink::create("-"), "-");
  return compress_mesh(mesh, *sink, how, spool);
}

SizeReport CompressCommand::write_to_file(MeshSource& mesh, const CompressOptions& how,
                                          Spool& spool) const {
  OutputFile file(output, spool_directory(*this));
  SizeReport sizes = compress_mesh(mesh, file.sink(), how, spool);
  if (parity) {
    const std::uint64_t bytes = protect(file, *parity / 100, how.progress);
    sizes.streams["parity"] = bytes;
    sizes.total_bytes += bytes;
  }
  file.commit();
  return sizes;
}

Places CompressCommand::places() {
  Places places{files_of(input), output, true};
  places.inputs.push_back(cell_order);
  return places;
}

bool CompressCommand::is_for(const Format* format) const {
  return format != nullptr && format->name != "shm";
}

std::string CompressCommand::why_passed_over(const std::string& path) const {
  std::error_code none;
  if (!output.empty() && !std::filesystem::is_directory(output, none)) return {};
  if (!std::filesystem::is_regular_file(path, none) || !is_shm(path)) return {};
  return "is already a .shm file; -o FILE compresses it again";
}

std::string CompressCommand::output_beside(const std::string& path) const {
  if (path == "-") return path;
  std::error_code none;
  if (!std::filesystem::exists(path, none) && series_of(path))
    wrong_use(path + " is the name of a series of files; -o must name the .shm file");
  return unpacked_name(path) + ".shm";
}

void CompressCommand::check_use() const {
  if (output == "-" && json)
    wrong_use("--json and the compressed mesh cannot both go to standard output");
  if (!cell_order.empty() && order != "free")
    wrong_use("--cell-order needs --order free; --order is " + order);
  if (parity && !has_parity_codes())
    wrong_use("--parity needs ISA-L; this shm was built without it");
  if (remove && (abs || rel || bits > 0 || !arrays.empty()))
    wrong_use("--rm needs lossless compression; --abs, --rel, --bits and --array round values");
}

ExitCode CompressCommand::run() {
  check_use();
  if (remove) check_removable(input);
  CompressOptions wanted = how();
  const auto start = std::chrono::steady_clock::now();
  ProgressLine line(*this);
  // With --order free, the default memory limit is higher, because the mesh is accessed in random
  // order. With a low limit, pages that have been written to disk would soon have to be read again.
  Spool spool(spool_directory(*this), spool_memory(*this, order == "free"), mesh_limits(*this));
  line.show("reading " + input);
  ToolInput in(*this);
  const auto mesh = in.open(spool, line.callback());

  wanted.progress = line.callback();
  line.expect(phases_of(mesh->info()), in.bytes());
  std::optional<CellSequence> given_order;
  if (!cell_order.empty())
    wanted.cell_order = &given_order.emplace(read_cell_order(cell_order, mesh->info().cells()));
  CompressRun result;
  result.input = input;
  result.output = output;
  result.input_bytes = in.bytes();
  result.sizes = output == "-" && !parity ? write_to_pipe(*mesh, wanted, spool)
                                          : write_to_file(*mesh, wanted, spool);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  keep_attributes(input, output);
  if (remove)
    remove_source(input, output, *this, line.callback(), given_order ? &*given_order : nullptr);
  line.wipe();
  if (json)
    std::fputs(compress_json(result, mesh->info()).c_str(), stdout);
  else
    print(*this, compress_text(result, mesh->info()));
  if (!json && !quiet && !remove) hint_at_free_order(*mesh, wanted, result, spool);
  return kDone;
}

}  // namespace shm::converters
