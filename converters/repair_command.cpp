#include "repair_command.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "output_file.h"
#include "parity.h"

namespace shm::converters {
namespace {

struct Repair {
  std::uint64_t blocks = 0, healed = 0, damaged_packets = 0;
  std::vector<std::uint64_t> lost;  // blocks
};

std::string counted(std::uint64_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

// Blocks as byte ranges of the file: "0-4095, 12288-20479"; the first few of them.
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

std::string json_of(const Repair& repair, const Options& options) {
  nlohmann::json json;
  json["file"] = options.input;
  json["output"] = options.output;
  json["blocks"] = repair.blocks;
  json["healed_blocks"] = repair.healed;
  json["damaged_parity_packets"] = repair.damaged_packets;
  return json.dump(2) + "\n";
}

std::string text_of(const Repair& repair, const Options& options) {
  if (repair.healed == 0 && repair.damaged_packets == 0)
    return options.output + ": nothing was damaged\n";
  return options.output + ": as it was; " + counted(repair.healed, "block") + " of " +
         std::to_string(repair.blocks) + " healed, " + counted(repair.damaged_packets, "packet") +
         " of parity made anew\n";
}

}  // namespace

ExitCode run_repair(Options& options) {
  if (options.output == "-" && options.json)
    wrong_use("--json and the .shm file cannot both go to standard output");
  if (options.output.empty()) options.output = options.input;
  ProgressLine line(options.quiet);
  const auto file = unwrap(FileRandomSource::open(options.input), options.input);
  const auto protected_file = ProtectedFile::open(*file);
  if (!protected_file)
    throw Failure(Error{ErrorCode::corrupt, "there is no parity to heal it by (compress --parity)",
                        "parity", kNoOffset, options.input});
  protected_file->check(line.callback());
  const std::string folder = spool_directory(options);
  const auto scratch = unwrap(FileSink::create_scratch(folder, "repair"), folder);
  Repair repair;
  repair.blocks = protected_file->shape().blocks();
  repair.damaged_packets = protected_file->damaged_packets();
  repair.lost = protected_file->heal(*scratch, line.callback());
  repair.healed = protected_file->damaged_blocks().size() - repair.lost.size();
  if (!repair.lost.empty())
    throw Failure(
        Error{ErrorCode::corrupt,
              counted(repair.lost.size(), "block") + " of " + std::to_string(repair.blocks) +
                  " cannot be healed, more than parity goes for: bytes " + ranges_text(repair.lost),
              "parity", kNoOffset, options.input});
  // Parity may be of something else that stood here.
  if (!is_whole_file(protected_file->healed()))
    throw Failure(Error{ErrorCode::corrupt, "its parity does not protect a whole .shm file",
                        "parity", kNoOffset, options.input});
  OutputFile output(options.output, folder);
  unwrap(output.sink().copy(protected_file->healed(), 0, protected_file->healed().size()),
         options.output);
  write_parity(protected_file->healed(), protected_file->shape(), output.sink(), line.callback());
  output.commit();
  line.wipe();
  if (options.json)
    std::fputs(json_of(repair, options).c_str(), stdout);
  else
    say(options, text_of(repair, options));
  return kDone;
}

ParityState parity_state(const std::string& path, const Progress& progress) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  const auto protected_file = is_whole_file(*file) ? nullptr : ProtectedFile::open(*file);
  if (!protected_file) return {};
  // A mesh that is sound ends with its trailer; parity of more or less is not of this file.
  SectionSource itself(*file, 0, protected_file->shape().protected_bytes);
  if (!is_whole_file(itself)) return {};
  protected_file->check(progress);
  return {true, protected_file->shape().blocks(), protected_file->damaged_blocks().size(),
          protected_file->damaged_packets()};
}

void fail_with_hint(const Failure& failure, const std::string& path) {
  Error error = failure.error();
  if (error.code == ErrorCode::corrupt || error.code == ErrorCode::truncated ||
      error.code == ErrorCode::io) {
    const auto file = FileRandomSource::open(path);
    if (file && ProtectedFile::open(**file))
      error.detail += "; there is parity to heal it by: shm repair";
  }
  throw Failure(error);
}

std::string parity_text(const ParityState& state) {
  if (!state.there) return {};
  if (state.sound()) return ", parity of " + counted(state.blocks, "block") + " too";
  return "; of its parity " + counted(state.damaged_packets, "packet") + " and of its " +
         counted(state.blocks, "block") + " " + std::to_string(state.damaged_blocks) +
         " are not what they were (shm repair)";
}

}  // namespace shm::converters
