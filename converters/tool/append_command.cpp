#include "tool/append_command.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "archive/append.h"
#include "archive/parity.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "formats/formats.h"
#include "order/cell_order_file.h"
#include "tool/input.h"

namespace shm::converters {
namespace {

AppendHow how_of(const Options& options, const Progress& progress) {
  AppendHow how;
  how.all = options.all;
  how.steps = options.steps;
  how.time = options.time;
  how.strict = options.strict;
  how.options.level = level_of(options.level);
  how.options.key_steps = options.append_key_steps;
  how.threads = options.threads;
  how.progress = progress;
  return how;
}

std::string json_of(const AppendOutcome& outcome, const Options& options) {
  nlohmann::json json;
  json["file"] = options.input;
  json["source"] = options.against;
  json["output"] = options.output;
  json["appended_steps"] = outcome.steps;
  json["step_times"] = outcome.times;
  if (outcome.sizes) {
    json["bytes"] = outcome.sizes->total_bytes;
    json["streams"] = outcome.sizes->streams;
  }
  return json.dump(2) + "\n";
}

std::string text_of(const AppendOutcome& outcome, const Options& options) {
  if (outcome.steps.empty())
    return options.input + ": " + options.against + " has no later time step; nothing to do\n";
  const std::size_t fresh = outcome.steps.size(), all = outcome.times.size();
  return options.output + ": " + std::to_string(fresh) +
         (fresh == 1 ? " time step" : " time steps") + " more, " + std::to_string(all) +
         " in all, " + std::to_string(outcome.sizes->total_bytes) + " bytes\n";
}

ExitCode tell_differences(const AppendOutcome& outcome, const Options& options) {
  std::fprintf(stderr, "shm: %s does not hold the mesh of %s:\n", options.against.c_str(),
               options.input.c_str());
  for (const std::string& difference : outcome.differences)
    std::fprintf(stderr, "shm:   %s\n", difference.c_str());
  return kDifferent;
}

void copy_to(OutputFile& output, const std::string& path) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  unwrap(output.sink().copy(*file, 0, file->size()), path);
  output.commit();
}

// The share of parity that the file has, if any. New parity would make damage last, so there must
// be none.
std::optional<double> parity_to_renew(const std::string& path, const Progress& progress) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  const auto it = is_whole_file(*file) ? nullptr : ProtectedFile::open(*file);
  if (!it) return std::nullopt;
  it->check(progress);
  if (!it->damaged_blocks().empty())
    throw Failure(Error{ErrorCode::corrupt, "is damaged; its parity may heal it: shm repair",
                        "parity", kNoOffset, path});
  return it->share();
}

}  // namespace

ExitCode run_append(Options& options) {
  if (options.output == "-" && options.json)
    wrong_use("--json and the .shm file cannot both go to standard output");
  require_shm(options.input);
  if (options.output.empty()) options.output = options.input;
  ProgressLine line(options.quiet);
  Spool spool(spool_directory(options), spool_memory(options));
  line.show("reading " + options.against);
  ToolInput input(options, options.against);
  const auto source = input.open(spool, line.callback(), options.threads);
  AppendHow how = how_of(options, line.callback());
  std::optional<CellSequence> cell_order;
  if (!options.cell_order.empty())
    how.cell_order =
        &cell_order.emplace(read_cell_order(options.cell_order, source->info().cells()));
  const auto share = parity_to_renew(options.input, line.callback());
  OutputFile output(options.output, spool_directory(options));
  FileSink& sink = output.sink();
  const AppendOutcome outcome = append_steps(options.input, *source, sink, how, spool);
  line.wipe();
  if (!outcome.differences.empty()) return tell_differences(outcome, options);
  tell_losses(outcome.losses, options.output);
  if (outcome.sizes) {
    if (share) protect(sink, options.output, *share, line.callback());
    output.commit();
  } else if (!outcome.losses.empty())
    return kIncomplete;
  else if (options.output != options.input)
    copy_to(output, options.input);  // nothing is new: the same file, where it is wanted
  if (options.json)
    std::fputs(json_of(outcome, options).c_str(), stdout);
  else
    say(options, text_of(outcome, options));
  return kDone;
}

}  // namespace shm::converters
