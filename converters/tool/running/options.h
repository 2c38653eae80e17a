// Options that several commands share.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/schema.h"
#include "tool/running/command.h"
#include "tool/step_choice.h"
#include "tool/support.h"

namespace shm::converters {

// Adds a command to `tool`, with the options that all commands have. `options` must outlive `tool`.
CLI::App* add_command(CLI::App& tool, CommonOptions& options, const std::string& name,
                      const std::string& description, const std::string& examples);

// Functions that add options to a command that accepts several files. add_files() adds the list of
// files (described by `what`), -r and -T. add_output() adds -o (described by `output`), -f and -c.
void add_files(CLI::App& command, FileCommand& options, const std::string& what);
void add_output(CLI::App& command, FileCommand& options, const std::string& output,
                const std::string& type);
// Adds --rm and -k.
void add_removal(CLI::App& command, FileCommand& options);

// Return validators for the value of an option. whole_number() accepts a whole number from `least`
// to `most`. one_of() accepts the words in a list.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most = ~std::uint64_t{0});
CLI::Validator one_of(std::vector<std::string> words);

// Adds --part.
void add_part(CLI::App& command, CommonOptions& options);
void add_force(CLI::App& command, CommonOptions& options);
void add_threads(CLI::App& command, unsigned& threads, const std::string& what);
void add_order(CLI::App& command, std::string& order);
void add_level(CLI::App& command, std::string& level);
void add_format(CLI::App& command, std::string& format);
// Adds --strict: nothing is written if the output format cannot store all data of the mesh.
void add_strict(CLI::App& command, bool& strict);
// Adds --step and --time.
void add_steps(CLI::App& command, StepChoice& steps);

// Convert the value of --order, --level or --codec to an enumerator.
Order order_of(const std::string& name);
Level level_of(const std::string& name);
ConnectivityCodec codec_of(const std::string& name);

// Returns "auto" and the names of all codecs.
std::vector<std::string> codec_names();

// Returns a list of all format names for help texts: "exodus, vtk, ... or shm".
std::string format_names();
// Returns the help text for an input that may have any format.
std::string mesh_file_text();
// Returns the help text for an output that is one mesh.
std::string output_text();

}  // namespace shm::converters
