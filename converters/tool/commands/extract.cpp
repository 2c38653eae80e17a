#include "tool/commands/extract.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "archive/archive_files.h"
#include "base/counted_source.h"
#include "base/failure.h"
#include "base/text_input.h"
#include "compression/piece_mesh.h"
#include "compression/set_sides.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "mesh/array_names.h"
#include "series/step_files.h"
#include "sets/set_cells.h"
#include "tool/input.h"
#include "tool/output_name.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "tool/shown/array_choice.h"
#include "transfer/piece_output.h"
#include "transfer/translate.h"

namespace shm::converters {
namespace {

// --- values of options

CellSelection::Range range_of(const std::string& text, std::uint64_t cells) {
  const std::size_t colon = text.find(':');
  CellSelection::Range range;
  if (colon == std::string::npos ||
      !TextInput::parse(std::string_view(text).substr(0, colon), range.first) ||
      !TextInput::parse(std::string_view(text).substr(colon + 1), range.end))
    wrong_use("--cells " + text + ": must be A:B, for the cells A to B - 1");
  if (range.first >= range.end)
    wrong_use("--cells " + text +
              ": the range is empty; the mesh has cells 0:" + std::to_string(cells));
  if (range.end > cells)
    wrong_use("--cells " + text +
              ": the range exceeds the mesh, which has cells 0:" + std::to_string(cells));
  return range;
}

std::array<double, 6> box_of(const std::string& text) {
  std::array<double, 6> box{};
  std::string_view left = text;
  for (std::size_t c = 0; c < 6; ++c) {
    const std::size_t comma = left.find(',');
    if ((comma == std::string_view::npos) != (c == 5) ||
        !TextInput::parse(left.substr(0, comma), box[c]) || std::isnan(box[c]))
      wrong_use("--box " + text + ": must be six numbers, xmin,ymin,zmin,xmax,ymax,zmax");
    if (comma != std::string_view::npos) left.remove_prefix(comma + 1);
  }
  for (std::size_t c = 0; c < 3; ++c)
    if (box[c] > box[3 + c])
      wrong_use("--box " + text + ": " + "xyz"[c] + " has a minimum above its maximum");
  return box;
}

std::vector<std::uint32_t> blocks_of(const std::vector<std::string>& wanted,
                                     const std::vector<BlockInfo>& blocks) {
  std::set<std::uint32_t> found;
  for (const std::string& name : wanted)
    for (const std::uint32_t block : blocks_called(blocks, name, "--block")) found.insert(block);
  return {found.begin(), found.end()};
}

// Returns the indices of the arrays that the user named. LOCATION/NAME selects an array at this
// location, e.g. point/NAME, and NAME the arrays at all locations. If no array is named v, the name
// v selects v_x, v_y and v_z.
std::vector<std::uint32_t> arrays_of(const std::vector<std::string>& wanted,
                                     const std::vector<ArrayInfo>& arrays) {
  std::set<std::uint32_t> found;
  for (const std::string& text : wanted) {
    bool any = false;
    const auto take = [&](const std::string& name) {
      for (std::uint32_t a = 0; a < arrays.size(); ++a)
        if (arrays[a].name == name || array_label(arrays[a]) == name) {
          found.insert(a);
          any = true;
        }
    };
    take(text);
    if (!any)
      for (const char* axis : {"_x", "_y", "_z"}) take(text + axis);
    if (!any) wrong_use("there is no array " + text + "; there are " + listed(arrays, array_label));
  }
  return {found.begin(), found.end()};
}

MeshSet set_of(const std::string& text, const std::vector<MeshSet>& sets) {
  std::vector<MeshSet> found;
  for (const MeshSet& set : sets)
    if (set.name == text) found.push_back(set);
  if (found.empty())
    for (MeshSet set : sets) {
      std::string name = std::exchange(set.name, {});
      if (std::to_string(set.id) != text && short_name_of(set) != text) continue;
      set.name = std::move(name);
      found.push_back(std::move(set));
    }
  const auto label = [](const MeshSet& set) { return label_of(set); };
  if (found.empty()) wrong_use("there is no set " + text + "; there are " + listed(sets, label));
  if (found.size() > 1)
    wrong_use("several sets are called " + text + ": " + listed(found, label) +
              "; use side_set_N, node_set_N or element_set_N");
  return found.front();
}

// --- the extraction

class Extraction {
 public:
  Extraction(const ExtractCommand& options, Spool& spool)
      : options_(options),
        files_(options.output, options.format),
        format_(files_.format()),
        spool_(spool) {}

  // Extracts the piece and writes it. If data would be lost and --strict was given, writes nothing
  // and returns false.
  bool run(ProgressLine& line);
  std::string summary() const;

 private:
  void open();
  void choose_cells();
  void choose_set();
  void choose_steps();
  void stage();
  Translation translated(std::optional<StepRange> step, Spool& spool);
  bool write_each(ProgressLine& line);

  const ExtractCommand& options_;
  const StepFiles files_;
  const Format& format_;
  Spool& spool_;
  std::unique_ptr<FileRandomSource> file_;
  std::unique_ptr<SectionSource> member_;
  std::unique_ptr<CountedSource> source_;
  std::optional<MeshExtractor> extractor_;
  MeshInfo whole_;  // schema, counts, times and extras of the whole file
  std::vector<MeshSet> sets_;
  std::optional<MeshSet> wanted_set_;
  std::optional<StepRange> steps_;
  PieceOptions how_;
  LossList losses_;
  std::vector<std::unique_ptr<MeshSource>> layers_;
  PieceMesh* piece_ = nullptr;
  std::string written_;
};

void Extraction::open() {
  const std::string& path = options_.input;
  if (path == "-") wrong_use("extract needs random access to its input; IN is standard input");
  const Format* format = format_of_file(path);
  if (format == nullptr || format->name != "shm")
    throw Failure(ErrorCode::unsupported, "is not a .shm file; use shm compress to create one",
                  path);
  file_ = unwrap(FileRandomSource::open(path), path);
  RandomSource* source = file_.get();
  if (is_archive(path)) {
    const ArchiveReader archive = unwrap(ArchiveReader::open(*file_), path);
    const ArchiveMember& member = part_of(archive.members(), options_.part, path);
    member_ = std::make_unique<SectionSource>(*file_, member.offset, member.bytes);
    source = member_.get();
  } else if (!options_.part.empty()) {
    wrong_use("--part needs an archive; " + path + " is not one");
  }
  source_ = std::make_unique<CountedSource>(*source);
  extractor_.emplace(unwrap(MeshExtractor::open(*source_), path));
  whole_ = info_of(*extractor_, path);
}

void Extraction::choose_cells() {
  CellSelection& cells = how_.request.cells;
  if (!options_.cells.empty()) cells.range = range_of(options_.cells, whole_.cells());
  if (!options_.blocks.empty()) cells.blocks = blocks_of(options_.blocks, whole_.schema.blocks);
  if (!options_.box.empty()) cells.box = box_of(options_.box);
  if (!options_.arrays.empty()) how_.arrays = arrays_of(options_.arrays, whole_.schema.arrays);
  if (!format_.holds_everything) how_.maps = format_.capabilities.maps;
  how_.flat = source_format(whole_).is_flat(whole_);
}

void Extraction::choose_set() {
  sets_ = take_sets(whole_);
  if (options_.set.empty()) return;
  wanted_set_ = set_of(options_.set, sets_);
  ExtractRequest& request = how_.request;
  std::vector<std::uint64_t> members = wanted_set_->members;
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
  if (wanted_set_->kind == MeshSet::Kind::nodes) {
    if (request.cells.range || request.cells.blocks)
      wrong_use("--cells and --block select cells and cannot be used for the nodes of " +
                label_of(*wanted_set_));
    request.vertices = std::move(members);
  } else if (!wanted_set_->blocks.empty()) {
    std::vector<std::uint32_t> blocks = wanted_set_->blocks;
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    if (request.cells.blocks)
      std::erase_if(blocks, [&](std::uint32_t b) {
        return !std::binary_search(request.cells.blocks->begin(), request.cells.blocks->end(), b);
      });
    request.cells.blocks = std::move(blocks);
  } else {
    request.cells.numbers = std::move(members);
  }
}

void Extraction::choose_steps() {
  const std::size_t steps = whole_.step_times.size();
  steps_ = options_.steps.in(whole_.step_times);
  const bool every_step = !files_.is_one_file() || format_.capabilities.every_step;
  if (steps_ && steps_->size() > 1 && !every_step)
    wrong_use("--step " + options_.steps.words + " selects " + std::to_string(steps_->size()) +
              " steps, but a file of format " + std::string(format_.name) +
              " holds one step; a name such as out_%04d writes one file per step");
  if (steps_ && steps_->size() == 1 && files_.is_one_file()) how_.step = steps_->first;
  if (steps == 0 || (!how_.step && every_step)) return;
  const std::uint64_t step = how_.step.value_or(steps - 1);
  const auto points = source_format(whole_).points_of_step(whole_, step);
  if (points && !whole_.schema.arrays[*points].per_step &&
      whole_.schema.arrays[*points].type == whole_.schema.coordinate_type)
    how_.points = static_cast<std::uint32_t>(*points);
  else if (points)
    losses_.push_back("points of time step " + std::to_string(step) +
                      " (whose number type is not that of the mesh's coordinates)");
}

void Extraction::stage() {
  auto piece =
      std::make_unique<PieceMesh>(*extractor_, how_, whole_.extras, sets_, options_.input, spool_);
  piece_ = piece.get();
  for (const std::string& set : piece->without_factors())
    losses_.push_back("distribution factors of " + set);
  for (const std::string& array : piece->without_sets())
    losses_.push_back("array '" + array + "', because its sets have other members");
  if (piece->info().vertices == 0 && piece->info().cells() == 0) {
    std::string box;
    for (std::size_t c = 0; c < 6; ++c) {
      double end = c < 3 ? std::numeric_limits<double>::infinity()
                         : -std::numeric_limits<double>::infinity();
      for (const SegmentInfo& segment : extractor_->segments())
        end = c < 3 ? std::min(end, segment.box[c]) : std::max(end, segment.box[c]);
      char text[32];
      std::snprintf(text, sizeof text, "%s%.6g", c > 0 ? "," : "", end);
      box += text;
    }
    wrong_use("nothing to extract: no " + std::string(how_.request.vertices ? "vertex" : "cell") +
              " meets all conditions; the bounding box of the mesh is " + box);
  }
  layers_.push_back(std::move(piece));
  if (steps_ && steps_->size() > 1 && files_.is_one_file())
    layers_.push_back(std::make_unique<ChosenSteps>(*piece_, *steps_));
  if (!wanted_set_ || wanted_set_->kind == MeshSet::Kind::elements) return;
  MeshSet cut = *wanted_set_;
  cut.members.clear();
  cut.sides.clear();
  const bool of_nodes = cut.kind == MeshSet::Kind::nodes;
  const auto& numbers = of_nodes ? piece_->vertex_numbers() : piece_->cell_numbers();
  for (std::size_t i = 0; i < wanted_set_->members.size(); ++i) {
    const auto rank = rank_of(numbers, wanted_set_->members[i]);
    if (!rank) continue;
    cut.members.push_back(*rank);
    if (!of_nodes) cut.sides.push_back(wanted_set_->sides[i]);
  }
  if (of_nodes) {
    std::sort(cut.members.begin(), cut.members.end());
    layers_.push_back(std::make_unique<SetCells>(*layers_.back(), std::vector{cut}, false, spool_));
    return;
  }
  auto sides = std::make_unique<SetSides>(
      *layers_.back(), cut, source_format(whole_).is_flat(whole_), piece_->cell_numbers());
  if (sides->left_out() > 0)
    losses_.push_back(std::to_string(sides->left_out()) + " sides of " + label_of(cut) +
                      " (of cells whose sides are not known)");
  layers_.push_back(std::move(sides));
}

// Translates the piece to the target format. Extras of the source are always translated and never
// passed on unchanged, even if the target format could store them, because they describe the whole
// mesh.
Translation Extraction::translated(std::optional<StepRange> step, Spool& spool) {
  Capabilities capabilities = format_.capabilities;
  capabilities.sibling = {};
  return {*layers_.back(), std::string(format_.name), capabilities, step, spool};
}

bool Extraction::run(ProgressLine& line) {
  open();
  choose_cells();
  choose_set();
  choose_steps();
  if (files_.is_one_file()) check_output_name(options_.output, format_, whole_, steps_);
  stage();
  if (!files_.is_one_file()) return write_each(line);
  Translation translation = translated(std::nullopt, spool_);
  losses_.insert(losses_.end(), translation.losses().begin(), translation.losses().end());
  line.wipe();
  report_losses(losses_, options_.output);
  if (options_.strict && !losses_.empty()) return false;
  line.show("writing " + options_.output);
  FromElsewhere mesh(translation.mesh(), whole_);
  write_mesh(mesh, options_.output, format_, spool_);
  line.wipe();
  written_ = options_.output + ": " + counts_text(mesh.info());
  return true;
}

// Writes one file per time step.
bool Extraction::write_each(ProgressLine& line) {
  MeshInfo info = layers_.back()->info();
  const StepRange range = steps_in_files(info, steps_);
  LossCollector all(&losses_);
  for (std::uint64_t step = range.first; step < range.end; ++step) {
    Spool own(spool_.directory(), spool_.memory_budget(), spool_.limits());
    const Translation translation = translated(step_in_file(info, step), own);
    for (const std::string& loss : translation.losses()) all.add(loss);
  }
  line.wipe();
  report_losses(losses_, options_.output);
  if (options_.strict && !losses_.empty()) return false;
  files_.begin();
  for (std::uint64_t step = range.first; step < range.end; ++step) {
    line.show("writing " + options_.output, step - range.first, range.size());
    // Each file has its own spool (temporary storage), whose disk space is freed when the file is
    // complete.
    Spool own(spool_.directory(), spool_.memory_budget(), spool_.limits());
    Translation translation = translated(step_in_file(info, step), own);
    FromElsewhere mesh(translation.mesh(), whole_);
    write_mesh(mesh, files_.file(step), format_, own);
  }
  files_.finish(info, range, spool_);
  line.wipe();
  if (!info.step_times.empty()) info.step_times.resize(range.size());
  written_ = files_.files(range) + ": " + counts_text(info);
  return true;
}

std::string Extraction::summary() const {
  return written_ + "; read " + std::to_string(source_->distinct_bytes()) + " of " +
         std::to_string(source_->size()) + " bytes\n";
}

}  // namespace

CLI::App* ExtractCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "extract",
      "Write a piece of a .shm file as a separate mesh, in any format. Only the bytes that the\n"
      "piece needs are read. Cells must meet all given conditions; without a condition, all cells\n"
      "are written. Vertices and cells are renumbered, but keep their order; the arrays\n"
      "shm_vertex_number and shm_cell_number (in Exodus: the number maps) contain their numbers "
      "in\n"
      "IN. Sets lose the members that are not in the piece",
      "  shm extract rotor.e.shm part.vtu --box 0,0,0,1,1,0.5 --array temperature --step 12\n"
      "  shm extract rotor.e.shm casing.e --block casing\n"
      "  shm extract rotor.e.shm inlet.vtk --set inlet     its sides, as quads and triangles\n"
      "  shm extract rotor.e.shm first.shm --cells 0:100000\n"
      "  shm extract pieces.shm box.vtu --part rotor.e.4.0 --box 0,0,0,1,1,1");
  command->add_option("IN", input, ".shm file (not a pipe)")->required()->type_name("");
  command->add_option("OUT", output, output_text())->required()->type_name("");
  add_force(*command, *this);
  add_format(*command, format);
  command
      ->add_option(
          "--cells", cells,
          "Only cells A to B - 1, counted from 0 in the order of IN, which is the order of the "
          "source if\nIN was compressed with --order keep")
      ->type_name("A:B");
  command
      ->add_option("--block", blocks,
                   "Only cells of the blocks with this name, or with this id if no block has the "
                   "name. May be\nrepeated")
      ->allow_extra_args(false)
      ->type_name("ID");
  command
      ->add_option("--box", box,
                   "Only cells with at least one vertex in this box or on its faces: "
                   "xmin,ymin,zmin,xmax,ymax,zmax")
      ->type_name("BOX");
  command
      ->add_option(
          "--set", set,
          "Only this set, given by name or number, or as side_set_N, node_set_N or element_set_N.\n"
          "For an element set or physical group, its cells are written. For a side set, its sides "
          "are\nwritten as cells, with the values of their points. For a node set, its points are "
          "written as\ncells; --box is then the only other condition that is allowed")
      ->type_name("NAME");
  command
      ->add_option(
          "--array", arrays,
          "Only this array (and number maps): NAME, or LOCATION/NAME such as point/NAME; v means "
          "v_x, v_y\nand v_z. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME");
  add_steps(*command, steps);
  command->add_option("--part", part, "File to read if IN is an archive (default: its only file)")
      ->type_name("NAME");
  command->add_flag("--strict", strict,
                    "Write nothing (exit code 6) if OUT would lack data of the piece. Such data is "
                    "listed on\nstandard error in any case");
  return command;
}

Places ExtractCommand::places() {
  const StepFiles files(output, format);
  return {{input}, output, files.format().name == "shm", files.files_there()};
}

ExitCode ExtractCommand::run() {
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  Extraction extraction(*this, spool);
  line.show("reading " + input);
  if (!extraction.run(line)) return kIncomplete;
  print(*this, extraction.summary());
  return kDone;
}

}  // namespace shm::converters
