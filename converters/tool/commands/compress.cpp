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

// "5%", or "5": above 0, 100 at most.
double percent_of(const std::string& text) {
  double percent = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, percent);
  if (error != std::errc() || (at != end && (*at != '%' || at + 1 != end)) ||
      !(percent > 0 && percent <= 100))
    throw CLI::ValidationError("--parity", "'" + text + "' is no share above 0 and up to 100%");
  return percent;
}

// A hint on standard error when order and numbers that nobody may need are much of the file. Looks
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

}  // namespace

CLI::App* CompressCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "compress", "Compress a mesh with all its data into a .shm file",
      "  shm compress rotor.e                     writes rotor.e.shm, gives back all as it was\n"
      "  shm compress -r runs --rm                each mesh in the folder runs and below, which "
      "goes\n"
      "                                           once its .shm has been found to be the same\n"
      "  shm compress 'run_%04d.vtu' -o run.shm   a file for each time step; or run.pvd\n"
      "  shm compress part.vtk -o part.shm --json sizes of all streams for a program\n"
      "  shm compress part.msh --order stream --delay 100\n"
      "                                           smaller: vertices renumbered, cells reordered\n"
      "  shm compress part.e --order free         the same mesh in the order that is smallest\n"
      "  shm compress scan.vtk --bits 16          coordinates rounded to 16 bits of the box\n"
      "  shm compress flow.e --rel 1e-4           coordinates and fields within 1e-4 of their "
      "range\n"
      "  shm compress flow.e --abs 1e-6 --array coordinates:lossless --array point/T:abs=0.01");
  add_files(*command, *this, mesh_file_text() + ",\nas it is or packed by gzip, xz or zstd");
  add_output(*command, *this, "File to write, or folder for IN.shm (default: IN.shm beside IN)",
             "OUT.shm");
  add_removal(*command, *this);
  add_order(*command, order);
  add_level(*command, level);
  command
      ->add_option("--delay", delay,
                   "Cells in the delay buffer, 0 for none\n"
                   "(default: none; in --order stream what a trial on a sample finds smaller)")
      ->check(whole_number(0, 1u << 20))
      ->type_name("N");
  command
      ->add_option("--cell-order", cell_order,
                   "For --order free: the cells in the order of this file, a number from 0 in each "
                   "line,\ninstead of a search; verify needs the file too")
      ->type_name("FILE");
  command->add_option("--bits", bits, "Round coordinates to N bits of the bounding box, 1..52")
      ->check(whole_number(1, 52))
      ->type_name("N");
  command
      ->add_option("--abs", abs,
                   "Round coordinates and all floating-point fields; no finite value moves by more "
                   "than E,\nand what is not finite stays (--bits, if given, is for coordinates)")
      ->type_name("E");
  command
      ->add_option("--rel", rel,
                   "The same, with a bound for each array: E times its range over all components, "
                   "blocks and\nsteps; for coordinates the largest side of their box")
      ->type_name("E");
  command
      ->add_option("--array", arrays,
                   "For one array, whatever the options above say: NAME:abs=E, NAME:rel=E, "
                   "NAME:bits=N or\nNAME:lossless; NAME is coordinates or an array's, as "
                   "point/NAME or cell/NAME where there are\nseveral. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME:HOW");
  command
      ->add_option(
          "--codec", codec,
          "Connectivity: auto, what the level tries (default); paper, the published scheme; rows; "
          "replay, fast on regular layouts; mixed, smallest, half as fast as rows; shifts, many "
          "times faster\nwhere numbers run in rows and layers, coordinates and arrays too, which "
          "may take "
          "more room\n(no delay); patterns, the same for meshes of any kind")
      ->check(one_of(codec_names()))
      ->type_name(CLI::detail::join(codec_names(), "|"));
  command
      ->add_option_function<std::string>(
          "--parity", [this](const std::string& text) { parity = percent_of(text); },
          "Add so much of the file again as parity, such as 5%: shm repair then heals what is "
          "lost\n"
          "of it, wherever that is, while it is less")
      ->type_name("P%");
  command
      ->add_option("--segment-cells", segment_cells,
                   "Start afresh every N cells, for random access and threads (default: by budget)")
      ->check(whole_number(1))
      ->type_name("N");
  command
      ->add_option("--restart-budget", restart_budget,
                   "Start afresh where at most P percent of the vertices have to be stored again\n"
                   "(default: 0.2; 0: never)")
      ->check(CLI::Validator(
          [](const std::string& word) {
            double percent = 0;
            const bool right = TextInput::parse(std::string_view(word), percent);
            return right && percent >= 0 && percent <= 100
                       ? std::string()
                       : "'" + word + "' is no number from 0 to 100";
          },
          ""))
      ->type_name("P");
  command
      ->add_option(
          "--key-steps", key_steps,
          "Of N time steps in turn at least one refers to no other, so that reading can\n"
          "begin there (default: 8; 1: all, so for a mesh of one step: give 8 where shm append is\n"
          "to put more behind it)")
      ->check(whole_number(1, ~std::uint32_t{0}))
      ->type_name("N");
  command->add_flag("--json", json, "Print the sizes as JSON");
  return command;
}

// --array beats the others; for coordinates --bits beats --abs and --rel.
Lossy CompressCommand::lossy() const {
  if (abs && rel) wrong_use("--abs and --rel exclude each other");
  Lossy wanted;
  if (abs) wanted.fields = parse_accuracy("abs=" + *abs, "--abs");
  if (rel) wanted.fields = parse_accuracy("rel=" + *rel, "--rel");
  wanted.coordinates = bits > 0 ? Accuracy::of_bits(bits) : wanted.fields;
  for (const std::string& text : arrays)
    wanted.named.push_back(parse_named_accuracy(text, "--array"));
  return wanted;
}

CompressOptions CompressCommand::how() const {
  if (!(restart_budget >= 0)) wrong_use("--restart-budget must be a number from 0 to 100");
  if (delay.value_or(0) > 0 && order == "free")
    wrong_use("--order free needs --delay 0, since it moves cells anyway; it is " +
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
  return wanted;
}

// Roughly as a profile has them: a byte of a cell or a step costs as much in each of its phases.
std::vector<ExpectedPhase> CompressCommand::phases_of(const MeshInfo& info) const {
  const MeshBytes bytes = bytes_of_mesh(info);
  const double cells = static_cast<double>(bytes.cells);
  std::vector<ExpectedPhase> phases;
  if (order == "free")
    phases = {{"taking up cells", .1 * cells},   {"sorting vertices", .1 * cells},
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
  return "is a .shm file already; -o names another one";
}

std::string CompressCommand::output_beside(const std::string& path) const {
  if (path == "-") return path;
  std::error_code none;
  if (!std::filesystem::exists(path, none) && series_of(path))
    wrong_use(path + " is a name of many files; -o names the .shm file");
  return unpacked_name(path) + ".shm";
}

void CompressCommand::check_use() const {
  if (output == "-" && json)
    wrong_use("--json and the compressed mesh cannot both go to standard output");
  if (!cell_order.empty() && order != "free")
    wrong_use("--cell-order needs --order free; it is " + order);
  if (parity && !has_parity_codes()) wrong_use("--parity needs ISA-L; this shm was built without");
  if (remove && (abs || rel || bits > 0 || !arrays.empty()))
    wrong_use("--rm needs a file that gives all back; --abs, --rel, --bits and --array round");
}

ExitCode CompressCommand::run() {
  check_use();
  if (remove) check_removable(input);
  CompressOptions wanted = how();
  const auto start = std::chrono::steady_clock::now();
  ProgressLine line(*this);
  // An incoherent mesh is read in any order: pages that go to disk would come back soon.
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
