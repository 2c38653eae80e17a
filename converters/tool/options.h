// The commands of the tool shm, and what they can be told.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/schema.h"
#include "tool/diff_command.h"

namespace shm::converters {

struct Options {
  std::string input, output, format, against, temp, cell_order, directory = ".";
  std::string spooled;  // where standard input went, if anywhere
  std::vector<std::string> inputs, members;
  std::string order = "keep";
  std::optional<std::uint32_t> delay;  // none told: as a trial finds
  std::uint32_t bits = 0;
  std::optional<std::string> abs, rel;
  std::vector<std::string> arrays;  // NAME:ACCURACY; of extract NAME
  std::string cells, box, set, part;
  std::vector<std::string> blocks;
  std::string level = "default", codec = "auto";
  std::uint64_t segment_cells = 0;
  double restart_budget = .2;  // percent
  std::optional<std::uint32_t> key_steps;
  unsigned threads = 0;  // one for each core
  std::optional<std::uint64_t> step;
  std::optional<std::uint64_t> memory;  // bytes of the spool
  std::optional<double> parity;         // percent
  std::vector<std::uint64_t> steps;
  std::optional<double> time;
  std::uint32_t append_key_steps = 0;  // as in the file
  bool all = false;
  bool json = false, quiet = false, packed = false, strict = false;
  DiffCommand diff;
};

// Each adds a command to `app`; what it is told goes to `options`, which must outlive the app.
CLI::App* add_compress(CLI::App& app, Options& options);
CLI::App* add_decompress(CLI::App& app, Options& options);
CLI::App* add_append(CLI::App& app, Options& options);
CLI::App* add_convert(CLI::App& app, Options& options);
CLI::App* add_verify(CLI::App& app, Options& options);
CLI::App* add_diff(CLI::App& app, Options& options);
CLI::App* add_info(CLI::App& app, Options& options);
CLI::App* add_join(CLI::App& app, Options& options);
CLI::App* add_split(CLI::App& app, Options& options);
CLI::App* add_extract(CLI::App& app, Options& options);
CLI::App* add_repair(CLI::App& app, Options& options);
CLI::App* add_layout(CLI::App& app, Options& options);

// What the words of --order, --level and --codec mean.
Order order_of(const std::string& name);
Level level_of(const std::string& name);
ConnectivityCodec codec_of(const std::string& name);

}  // namespace shm::converters
