// The command of the tool shm that heals files.
#pragma once

#include "failure.h"
#include "tool_options.h"
#include "tool_support.h"

namespace shm::converters {

ExitCode run_repair(Options& options);

// How parity that stands behind a file is: what verify says of it. Empty where there is none.
struct ParityState {
  bool there = false;
  std::uint64_t blocks = 0, damaged_blocks = 0, damaged_packets = 0;

  bool sound() const { return damaged_blocks == 0 && damaged_packets == 0; }
};
ParityState parity_state(const std::string& path, const Progress& progress);
std::string parity_text(const ParityState& state);

// Throws it on; of a damaged file with parity it says so.
[[noreturn]] void fail_with_hint(const Failure& failure, const std::string& path);

}  // namespace shm::converters
