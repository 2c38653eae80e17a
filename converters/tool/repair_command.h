// The command of the tool shm that heals files, and what verify tells of damage.
#pragma once

#include "archive/parity.h"
#include "base/failure.h"
#include "tool/options.h"
#include "tool/support.h"

namespace shm::converters {

ExitCode run_repair(Options& options);

// Empty where there is none, or where it is of something else.
ParityState parity_state(const std::string& path, const Progress& progress);
std::string parity_text(const ParityState& state);

// Tells all that is damaged in the file at `path`, which is options.input or a copy of it, and then
// throws the failure on, with what repair can do about it.
[[noreturn]] void fail_with_damage(const Failure& failure, const std::string& path,
                                   const Options& options);

}  // namespace shm::converters
