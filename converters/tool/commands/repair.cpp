#include "tool/commands/repair.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "archive/damage_report.h"
#include "archive/parity.h"
#include "archive/salvage.h"
#include "base/failure.h"
#include "base/lenient_source.h"
#include "base/output_file.h"
#include "shm/damage.h"
#include "shm/summary.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

struct Repair {
  bool has_parity = false;
  std::uint64_t blocks = 0, healed = 0, damaged_packets = 0;
  std::vector<std::uint64_t> lost;  // indices of protected blocks that could not be repaired
  DamageReport damage;              // damage that parity could not repair
  bool new_index = false;
  std::optional<SalvageReport> salvaged;

  bool is_whole() const { return !salvaged || salvaged->missing.empty(); }
  bool was_sound() const {
    return !salvaged && healed == 0 && damaged_packets == 0 && damage.damages.empty();
  }
};

// Formats the byte ranges that `blocks` (indices of protected blocks) cover in the file, such as
// "0-4095, 12288-20479". Lists at most 8 ranges.
std::string ranges_text(const std::vector<std::uint64_t>& blocks) {
  constexpr int kMostRanges = 8;
  std::string text;
  int ranges = 0;
  for (std::size_t i = 0; i < blocks.size();) {
    std::size_t end = i + 1;
    while (end < blocks.size() && blocks[end] == blocks[end - 1] + 1) ++end;
    if (++ranges > kMostRanges) return text + ", ...";
    text += (text.empty() ? "" : ", ") + std::to_string(blocks[i] * kParityBlockBytes) + "-" +
            std::to_string((blocks[end - 1] + 1) * kParityBlockBytes - 1);
    i = end;
  }
  return text;
}

std::string outcome_json(const Repair& repair, const CommonOptions& options) {
  nlohmann::json json;
  json["file"] = options.input;
  json["output"] = options.output;
  json["outcome"] = repair.was_sound()  ? "sound"
                    : !repair.salvaged  ? "healed"
                    : repair.is_whole() ? "written anew"
                                        : "salvaged";
  json["blocks"] = repair.blocks;
  json["healed_blocks"] = repair.healed;
  json["lost_blocks"] = repair.lost.size();
  json["damaged_parity_packets"] = repair.damaged_packets;
  json["new_index"] = repair.new_index;
  json["damage"] = damage_json(repair.damage);
  json["missing"] = nlohmann::json::array();
  if (repair.salvaged) {
    json["vertices"] = repair.salvaged->vertices;
    json["cells"] = repair.salvaged->cells;
    json["missing"] = repair.salvaged->missing_json;
  }
  return json_text(json);
}

std::string salvage_text(const SalvageReport& salvaged, const CommonOptions& options) {
  std::string text = options.output + ": " + std::to_string(salvaged.vertices) + " vertices, " +
                     std::to_string(salvaged.cells) + " cells; ";
  if (salvaged.missing.empty()) {
    text += "nothing is missing, but the file was encoded again";
    if (!salvaged.laid_out.empty())
      text += ", without the layout of the " + salvaged.laid_out + " file it was made from";
    return text + "\n";
  }
  text += "missing from " + options.input + ":\n";
  for (const std::string& sentence : salvaged.missing) text += "  " + sentence + "\n";
  return text;
}

std::string outcome_text(const Repair& repair, const CommonOptions& options) {
  if (repair.salvaged) return salvage_text(*repair.salvaged, options);
  if (repair.was_sound()) return options.output + ": nothing was damaged\n";
  if (repair.new_index) {
    const bool others = repair.damage.has_other_ranges;
    return options.output +
           ": restored; every chunk was found except the index, which was rebuilt" +
           (others ? ", with value ranges taken from the restored values\n" : "\n");
  }
  if (!repair.has_parity) return options.output + ": restored; every chunk was found\n";
  return options.output + ": restored; " + counted(repair.healed, "block") + " of " +
         std::to_string(repair.blocks) + " healed, " + counted(repair.damaged_packets, "packet") +
         " of parity rewritten\n";
}

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code none;
  return a == b || std::filesystem::equivalent(a, b, none);
}

class RepairRun {
 public:
  RepairRun(const CommonOptions& options, ProgressLine& line) : options_(options), line_(line) {}
  Repair run();

 private:
  void heal();
  void find_rest();
  bool write_as_it_was();
  void salvage_rest();
  [[noreturn]] void fail_unhealed(std::string detail) const;

  const CommonOptions& options_;
  ProgressLine& line_;
  std::unique_ptr<FileRandomSource> file_;
  std::unique_ptr<LenientSource> lenient_;
  std::unique_ptr<ProtectedFile> protected_;
  std::unique_ptr<FileSink> scratch_;
  // The source from which the file is read. At first, this is the input file. If the input has its
  // own parity, heal() replaces it with a source in which damaged blocks are repaired.
  RandomSource* source_ = nullptr;
  Repair repair_;
};

// Repairs as much damage as possible by means of the parity of the file.
void RepairRun::heal() {
  file_ = unwrap(FileRandomSource::open(options_.input), options_.input);
  lenient_ = std::make_unique<LenientSource>(*file_);
  source_ = lenient_.get();
  protected_ = ProtectedFile::open(*file_);
  if (!protected_) return;
  protected_->check(line_.callback());
  const std::string folder = spool_directory(options_);
  scratch_ = unwrap(FileSink::create_scratch(folder, "repair"), folder);
  repair_.has_parity = true;
  repair_.blocks = protected_->shape().blocks();
  repair_.damaged_packets = protected_->damaged_packets();
  repair_.lost = protected_->heal(*scratch_, line_.callback());
  repair_.healed = protected_->damaged_blocks().size() - repair_.lost.size();
  // If the repaired bytes are not a whole .shm file, the parity may have been computed from an
  // earlier file with the same name.
  if (repair_.lost.empty() && !is_whole_file(protected_->healed()))
    throw Failure(Error{.code = ErrorCode::corrupt,
                        .detail = "its parity does not protect a whole .shm file",
                        .section = "parity",
                        .file = options_.input});
  if (!protected_->is_of_something_else()) source_ = &protected_->healed();
}

void RepairRun::fail_unhealed(std::string detail) const {
  if (!repair_.lost.empty())
    detail = counted(repair_.lost.size(), "block") + " of " + std::to_string(repair_.blocks) +
             " cannot be repaired, because there is too much damage for the parity: bytes " +
             ranges_text(repair_.lost) + "; " + detail;
  throw Failure(Error{.code = ErrorCode::corrupt,
                      .detail = std::move(detail),
                      .section = repair_.has_parity ? "parity" : "",
                      .file = options_.input});
}

// Finds the damage that parity could not repair. Some lost blocks may contain no damage, because a
// block counts as lost even if only its checksum is lost.
void RepairRun::find_rest() {
  if (repair_.has_parity && repair_.lost.empty()) return;
  line_.show("looking for damage");
  auto damage = find_damage(*source_);
  if (!damage && damage.error().code == ErrorCode::unsupported)
    fail_unhealed(damage.error().detail + ": only parity could repair it");
  repair_.damage = unwrap(std::move(damage), options_.input);
}

// Writes the file as it was before the damage. Returns false, and writes nothing, if the index is
// lost and cannot be rebuilt.
bool RepairRun::write_as_it_was() {
  OutputFile output(options_.output, spool_directory(options_));
  if (repair_.damage.damages.empty()) {
    // Data that was not committed is left out; parity that heals the file is written anew below.
    const auto end = bytes_of_file(*source_);
    unwrap(output.sink().copy(*source_, 0, end ? *end : source_->size()), options_.output);
  } else {
    repair_.new_index = !repair_.damage.restorable;
    if (repair_.new_index) line_.show("rebuilding the index");
    auto written = write_in_order(*source_, output.sink());
    const bool failed = !written && written.error().code != ErrorCode::io;
    if (repair_.new_index && failed) return repair_.new_index = false;
    unwrap(std::move(written), options_.input);
  }
  if (repair_.has_parity && source_ == &protected_->healed()) {
    const auto written = unwrap(FileRandomSource::open(output.temporary()), options_.output);
    if (written->size() != protected_->shape().protected_bytes)
      fail_unhealed("its parity does not protect a whole .shm file");
    write_parity(*written, protected_->shape(), output.sink(), line_.callback());
  }
  output.commit();
  return true;
}

void RepairRun::salvage_rest() {
  if (is_same_file(options_.input, options_.output))
    fail_unhealed("it cannot be restored exactly; -o OUT.shm writes its undamaged parts");
  OutputFile output(options_.output, spool_directory(options_));
  Spool spool(spool_directory(options_), spool_memory(options_), mesh_limits(options_));
  repair_.salvaged =
      salvage(*source_, repair_.damage, options_.input, output.sink(), spool, line_.callback());
  if (repair_.has_parity && source_ == &protected_->healed() && has_parity_codes())
    protect(output, protected_->share(), line_.callback());
  output.commit();
}

Repair RepairRun::run() {
  heal();
  find_rest();
  const DamageReport& damage = repair_.damage;
  const bool all_there = damage.damages.empty() || damage.restorable || damage.lacks_index;
  if (!all_there || !write_as_it_was()) salvage_rest();
  return std::move(repair_);
}

}  // namespace

CLI::App* RepairCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "repair",
      "Restore a damaged .shm file exactly, by means of its parity, or salvage its undamaged\n"
      "parts: every undamaged segment. If data is missing, it is listed, and the exit code is 7.",
      "  shm repair rotor.e.shm                  in place\n"
      "  shm repair rotor.e.shm -o healed.shm\n"
      "  shm repair rotor.e.shm -o rest.shm --json | jq .missing");
  command->add_option("IN", input, ".shm file")->required()->type_name("");
  command
      ->add_option("-o,--output", output,
                   "File to write (default: replace IN,\n"
                   "which is possible only if no data is lost)")
      ->type_name("OUT.shm");
  add_force(*command, *this);
  command->add_flag("--json", json, "Print the repaired blocks and the missing data as JSON");
  return command;
}

Places RepairCommand::places() {
  if (output.empty()) return {};  // the input is repaired in place
  return {{input}, output, true};
}

ExitCode RepairCommand::run() {
  if (output == "-" && json)
    wrong_use("--json and the .shm file cannot both go to standard output");
  if (output.empty()) output = input;
  ProgressLine line(*this);
  const Repair repair = RepairRun(*this, line).run();
  line.wipe();
  if (json)
    std::fputs(outcome_json(repair, *this).c_str(), stdout);
  else if (repair.is_whole())
    print(*this, outcome_text(repair, *this));
  else  // Missing data is listed even with --quiet, so that the user notices it.
    std::fputs(outcome_text(repair, *this).c_str(), output == "-" ? stderr : stdout);
  return repair.is_whole() ? kDone : kSalvaged;
}

}  // namespace shm::converters
