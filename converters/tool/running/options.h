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

// A command of the tool, with what all commands are given. `options` must outlive the tool.
CLI::App* add_command(CLI::App& tool, CommonOptions& options, const std::string& name,
                      const std::string& description, const std::string& examples);

// What commands of many files share: the files (`what` they are), -r, -T, and the threads (`what`
// one does); where something is written, -o (`output` describes it), -f and -c.
void add_files(CLI::App& command, FileCommand& options, const std::string& what);
void add_output(CLI::App& command, FileCommand& options, const std::string& output,
                const std::string& type);
// --rm and -k.
void add_removal(CLI::App& command, FileCommand& options);

// Checks of the word that an option is given: a whole number of this range, one of some words.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most = ~std::uint64_t{0});
CLI::Validator one_of(std::vector<std::string> words);

// --part.
void add_part(CLI::App& command, CommonOptions& options);
void add_force(CLI::App& command, CommonOptions& options);
void add_threads(CLI::App& command, unsigned& threads, const std::string& what);
void add_order(CLI::App& command, std::string& order);
void add_level(CLI::App& command, std::string& level);
void add_format(CLI::App& command, std::string& format);
// What another format than the mesh's own cannot hold.
void add_strict(CLI::App& command, bool& strict);
// --step and --time.
void add_steps(CLI::App& command, StepChoice& steps);

// What the words of --order, --level and --codec mean.
Order order_of(const std::string& name);
Level level_of(const std::string& name);
ConnectivityCodec codec_of(const std::string& name);

// "auto", and the words of all codecs.
std::vector<std::string> codec_names();

// All formats of the table: "exodus, vtk, ... or shm".
std::string format_names();
// The description of a file of any of them.
std::string mesh_file_text();
// That of an output of one mesh.
std::string output_text();

}  // namespace shm::converters
