#include "tool/commands/verify.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "archive/archive_files.h"
#include "archive/damage_report.h"
#include "archive/parity.h"
#include "base/lenient_source.h"
#include "compare/compare.h"
#include "files/mesh_files.h"
#include "order/cell_order_file.h"
#include "shm/damage.h"
#include "shm/summary.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

// Checks the parity of a file and returns its state. The state is empty if the file has no parity,
// or if the parity belongs to another file.
ParityState parity_state(const std::string& path, const Progress& progress) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  const auto protected_file = is_whole_file(*file) ? nullptr : ProtectedFile::open(*file);
  if (!protected_file) return {};
  // If the bytes that the parity protects are not a whole .shm file that ends with the trailer, the
  // parity belongs to another file.
  SectionSource itself(*file, 0, protected_file->shape().protected_bytes);
  if (!is_whole_file(itself)) return {};
  protected_file->check(progress);
  return {true, protected_file->shape().blocks(), protected_file->damaged_blocks().size(),
          protected_file->damaged_packets()};
}

// Returns the number of bytes after the end of the mesh that are not parity. An interrupted shm
// append may have left them.
std::uint64_t stray_bytes(RandomSource& file) {
  if (is_whole_file(file) || ProtectedFile::open(file)) return 0;
  const auto summary = read_summary(file);
  return summary ? summary->totals.trailing_bytes : 0;
}

std::uint64_t stray_bytes(const ToolInput& in) {
  return in.is_stream() ? 0 : stray_bytes(*unwrap(FileRandomSource::open(in.path()), in.path()));
}

std::string stray_text(std::uint64_t bytes) {
  return bytes == 0
             ? std::string()
             : ", but " + counted(bytes, "byte") + " after the end of the mesh do not belong to it";
}

std::string parity_text(const ParityState& state) {
  if (!state.there) return {};
  if (state.sound()) return ", parity of " + counted(state.blocks, "block") + " too";
  return "; damaged: " + counted(state.damaged_packets, "packet") + " of parity and " +
         std::to_string(state.damaged_blocks) + " of " + counted(state.blocks, "block") +
         " (see shm repair)";
}

// Returns the path of the file with which a member is compared, in the directory given by
// --against.
std::string source_of_member(const ArchiveMember& member, const std::string& directory) {
  const std::filesystem::path path = std::filesystem::path(directory) / member.name;
  return was_packed(member) && !std::filesystem::exists(path)
             ? std::filesystem::path(path).replace_extension().string()
             : path.string();
}

}  // namespace

CLI::App* VerifyCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "verify",
      "Decode all of a .shm file; with --against, check that it contains the same mesh\n"
      "as its source. For rounded data, print the largest error and check it against its bound",
      "  shm verify rotor.e.shm\n"
      "  shm verify -r archive                      all .shm files in a folder\n"
      "  shm verify rotor.e.shm --against rotor.e   exit code 1 if they differ");
  add_files(*command, *this, ".shm file, - for standard input");
  command->add_option("--against", against, "Mesh that IN was made from")->type_name("SOURCE");
  command
      ->add_option("--cell-order", cell_order,
                   "Cell order file used to compress IN with --order free")
      ->type_name("FILE");
  command->add_flag("--json", json,
                    "Print the result, the number of differences and the counts as JSON");
  return command;
}

bool VerifyCommand::is_for(const Format* format) const {
  return format != nullptr && format->name == "shm";
}

ExitCode VerifyCommand::verify_archive() {
  if (!against.empty() && !std::filesystem::is_directory(against))
    wrong_use("--against must be the directory of the source files if IN is an archive; " +
              against + " is not a directory");
  if (!cell_order.empty())
    wrong_use("--cell-order needs a file of one mesh; " + input + " is an archive");
  ArchiveFile archive(input);
  ExitCode code = kDone;
  for (const ArchiveMember& member : archive.members()) {
    ProgressLine line(*this);
    Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
    const auto restored = archive.open(member, spool, line.callback(), threads);
    const std::string place = archive.place(member);
    SectionSource bytes = archive.bytes(member);
    const std::uint64_t stray = stray_bytes(bytes);
    if (stray > 0) code = kDifferent;
    if (against.empty()) {
      line.wipe();
      if (json)
        std::fputs(sound_json(place, restored->info(), {}, stray).c_str(), stdout);
      else
        print(*this,
              place + ": sound, " + counts_text(restored->info()) + stray_text(stray) + "\n");
      continue;
    }
    const std::string path = source_of_member(member, against);
    const auto source = open_mesh(path, spool, line.callback());
    const CompareReport report = compare_meshes(*source, *restored, spool, line.callback());
    line.wipe();
    if (json)
      std::fputs(compare_json(report, path, place, restored->info(), stray).c_str(), stdout);
    else
      print(*this, compare_text(report, path, place, stray));
    if (!report.equal()) code = kDifferent;
  }
  return code;
}

// Reports all damage in the file at `path`, which is the input or a temporary copy of the input.
// Then throws `failure`, with a hint about shm repair added to its message.
void VerifyCommand::fail_with_damage(const Failure& failure, const std::string& path) const {
  Error error = failure.error();
  const bool may_be_damage = error.code == ErrorCode::corrupt ||
                             error.code == ErrorCode::truncated || error.code == ErrorCode::io;
  const auto file = FileRandomSource::open(path);
  if (!may_be_damage || !file) throw Failure(error);
  auto parity = ProtectedFile::open(**file);
  if (parity && parity->is_of_something_else()) parity = nullptr;
  // Search for damage only in the protected bytes. Do not search the parity packets that follow,
  // because those of a small file may contain copies of the protected bytes.
  LenientSource lenient(**file);
  const std::uint64_t bytes =
      parity ? std::min(parity->shape().protected_bytes, lenient.size()) : lenient.size();
  SectionSource itself(lenient, 0, bytes);
  const auto damage = find_damage(itself);
  const bool found = damage && !damage->damages.empty();
  if (parity)
    error.detail += "; its parity may repair it: shm repair";
  else if (found && damage->schema)
    error.detail += "; shm repair -o OUT.shm writes its undamaged parts";
  if (json) {
    nlohmann::json fields;
    fields["file"] = input;
    fields["sound"] = false;
    fields["error"] = error.message();
    fields["parity"] = parity != nullptr;
    fields["damage"] = damage ? damage_json(*damage) : nlohmann::json::array();
    std::fputs(json_text(fields).c_str(), stdout);
  } else if (found) {
    constexpr std::size_t kMostLines = 100;
    std::string text =
        "shm: " + input + ": damaged in " + counted(damage->damages.size(), "place") + "\n";
    for (const std::string& line : damage_lines(*damage, kMostLines))
      text += "shm:   " + line + "\n";
    std::fputs(text.c_str(), stderr);
  }
  throw Failure(error);
}

ExitCode VerifyCommand::run() {
  if (!cell_order.empty() && against.empty()) wrong_use("--cell-order needs --against SOURCE");
  if (!against.empty() && is_one_of_many) wrong_use("--against needs a single IN");
  ToolInput in(*this);
  if (!in.is_stream() && !in.is_series() && is_archive(in.path())) {
    input = in.path();
    return verify_archive();
  }
  in.require_shm();
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  std::unique_ptr<MeshSource> restored;
  line.expect({{"decoding", 1}, {"comparing", against.empty() ? 0 : .5}}, in.bytes());
  try {
    restored = in.open(spool, line.callback(), threads);
  } catch (const Failure& failure) {
    if (in.is_stream()) throw;
    line.wipe();
    fail_with_damage(failure, in.path());
  }
  const std::uint64_t stray = stray_bytes(in);
  if (against.empty()) {
    const ParityState parity =
        in.is_stream() ? ParityState() : parity_state(in.path(), line.callback());
    line.wipe();
    if (json)
      std::fputs(sound_json(input, restored->info(), parity, stray).c_str(), stdout);
    else
      print(*this, input + ": sound, " + counts_text(restored->info()) + parity_text(parity) +
                       stray_text(stray) + "\n");
    if (!parity.sound()) return kBadInput;
    return stray == 0 ? kDone : kDifferent;
  }
  line.show("reading " + against);
  ToolInput source_file(*this, against);
  const auto source = source_file.open(spool, line.callback());
  std::optional<CellSequence> given_order;
  if (!cell_order.empty()) given_order = read_cell_order(cell_order, source->info().cells());
  WatchedMesh watched(*source, line.callback(), "comparing");
  const CompareReport report = compare_meshes(watched, *restored, spool, line.callback(),
                                              given_order ? &*given_order : nullptr);
  line.wipe();
  if (json)
    std::fputs(compare_json(report, against, input, restored->info(), stray).c_str(), stdout);
  else
    print(*this, compare_text(report, against, input, stray));
  return report.equal() && stray == 0 ? kDone : kDifferent;
}

}  // namespace shm::converters
