#include "tool/running/options.h"

#include <algorithm>

#include "base/text_input.h"
#include "formats/formats.h"

namespace shm::converters {

namespace {

// Parses a size such as 512M. Replaces a validator of CLI11 whose messages are hard to understand
// ("x unit not recognized", and a list of 26 units).
const CLI::Validator kSize(
    [](std::string& word) {
      constexpr std::uint64_t kLeast = 1 << 20;
      const std::string given = word;
      const std::string wrong = "'" + given + "' is not a size such as 512M or 2G";
      if (given.starts_with('-')) return wrong;
      try {
        CLI::AsSizeValue(false)(word);
      } catch (const CLI::ValidationError&) {
        return wrong;
      }
      return std::stoull(word) < kLeast ? word + " bytes are too few; the minimum is 1M"
                                        : std::string();
    },
    "");

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return {
      [least, most](const std::string& word) {
        std::uint64_t number = 0;
        if (TextInput::parse(std::string_view(word), number) && number >= least && number <= most)
          return std::string();
        return "'" + word + "' is not a whole number " +
               (most < ~std::uint32_t{0}
                    ? "from " + std::to_string(least) + " to " + std::to_string(most)
                    : "of at least " + std::to_string(least));
      },
      ""};
}

CLI::Validator one_of(std::vector<std::string> words) {
  return {[words = std::move(words)](const std::string& word) {
            if (std::find(words.begin(), words.end(), word) != words.end()) return std::string();
            std::string list;
            for (std::size_t i = 0; i < words.size(); ++i)
              list += (i == 0 ? "" : i + 1 < words.size() ? ", " : " or ") + words[i];
            return "'" + word + "' is not " + list;
          },
          ""};
}

CLI::App* add_command(CLI::App& tool, CommonOptions& options, const std::string& name,
                      const std::string& description, const std::string& examples) {
  CLI::App* command = tool.add_subcommand(name, description);
  command->footer("Examples:\n" + examples);
  command
      ->add_option("--temp", options.temp,
                   "Directory for temporary files (default: that of the output, or of the system)")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command
      ->add_option(
          "--memory", options.memory,
          "Memory limit for tables, e.g. 512M (default: 256M; 1G with --order free and diff "
          "--match). Data\nbeyond the limit is stored in the --temp directory. A higher limit also "
          "allows .shm files with\nmore active vertices to be read")
      ->transform(kSize)
      ->type_name("SIZE");
  command
      ->add_option(
          "--max-output", options.max_output,
          "Refuse a mesh whose coordinates, values and cells need more than SIZE (exit code 5)")
      ->transform(kSize)
      ->type_name("SIZE");
  command
      ->add_option("--max-cells", options.max_cells,
                   "Refuse a mesh of more than N cells or more than N vertices (exit code 5)")
      ->check(whole_number(1, ~std::uint64_t{0}))
      ->type_name("N");
  command->add_flag("-q,--quiet", options.quiet, "Print no progress and no summary");
  return command;
}

void add_files(CLI::App& command, FileCommand& options, const std::string& what) {
  command.add_option("IN", options.files, what)->required()->type_name("");
  command.add_flag("-r,--recursive", options.recursive,
                   "Handle the files in folders and their subfolders; links are not followed");
  command
      .add_option("-T,--threads", options.threads,
                  "Use N threads (default: one per core). If there are several files, those below "
                  "32 MB are\nhandled in parallel")
      ->check(whole_number(1, 1024))
      ->type_name("N");
}

void add_output(CLI::App& command, FileCommand& options, const std::string& output,
                const std::string& type) {
  command.add_option("-o,--output", options.output, output)->type_name(type);
  command.add_flag("-c,--stdout", options.to_stdout, "Write to standard output, like -o -");
  add_force(command, options);
}

void add_removal(CLI::App& command, FileCommand& options) {
  CLI::Option* const remove = command.add_flag(
      "--rm", options.remove,
      "Remove IN after the output has been read back and found to contain the same mesh");
  command.add_flag("-k,--keep", options.keep, "Keep IN (default)")->excludes(remove);
}

void add_part(CLI::App& command, CommonOptions& options) {
  command
      .add_option("--part", options.part,
                  "File to read if the input is an archive (default: its only file)")
      ->type_name("NAME");
}

void add_force(CLI::App& command, CommonOptions& options) {
  command.add_flag("-f,--force", options.force,
                   "Overwrite an existing file, but never an input (default: ask on a terminal, "
                   "otherwise\nexit code 4)");
}

void add_threads(CLI::App& command, unsigned& threads, const std::string& what) {
  command.add_option("-T,--threads", threads, what + " with N threads (default: one per core)")
      ->check(whole_number(1, 1024))
      ->type_name("N");
}

void add_order(CLI::App& command, std::string& order) {
  command
      .add_option("--order", order,
                  "keep: keep vertex and cell numbers (default); stream: number vertices by first "
                  "use;\n"
                  "free: the same mesh, with cells in the order that compresses best (needs memory "
                  "or disk)")
      ->check(one_of({"keep", "stream", "free"}))
      ->type_name("keep|stream|free");
}

void add_level(CLI::App& command, std::string& level) {
  command
      .add_option("--level", level,
                  "fast: little work per cell; default; best: the smallest file, but slower.\n"
                  "Short forms: --fast, --best, and -1 to -9 (-1 to -3: fast, -7 to -9: best)")
      ->check(one_of({"fast", "default", "best"}))
      ->type_name("fast|default|best");
}

void add_format(CLI::App& command, std::string& format) {
  std::string names;
  for (const Format& one : formats()) names += (names.empty() ? "" : "|") + std::string(one.name);
  command
      .add_option("--format", format,
                  "Format of OUT (default: as its name indicates). It is an error if the name of "
                  "OUT indicates\n"
                  "another format that could store data which this format loses")
      ->type_name(names);
}

void add_strict(CLI::App& command, bool& strict) {
  command.add_flag("--strict", strict,
                   "Write nothing (exit code 6) if OUT has another format than the source and "
                   "cannot store all\nof its data. Lost data is listed on standard error in any "
                   "case");
}

void add_steps(CLI::App& command, StepChoice& steps) {
  auto* step = command
                   .add_option("--step", steps.words,
                               "Only time step N (from 0), first or last, or the steps A to B - 1\n"
                               "(default: all steps; only the last if a file of the format holds "
                               "one step)")
                   ->type_name("N|first|last|A:B");
  command.add_option("--time", steps.time, "Only the time step at time T")
      ->excludes(step)
      ->type_name("T");
}

Order order_of(const std::string& name) {
  for (const Order order : {Order::stream, Order::free})
    if (name == order_name(order)) return order;
  return Order::keep;
}

Level level_of(const std::string& name) {
  return name == "fast" ? Level::fast : name == "best" ? Level::best : Level::standard;
}

std::vector<std::string> codec_names() {
  std::vector<std::string> names = {"auto"};
  for (std::uint8_t number = 1;; ++number) {
    const std::string_view name = codec_name(static_cast<ConnectivityCodec>(number));
    if (name == codec_name(static_cast<ConnectivityCodec>(std::uint8_t{255}))) return names;
    names.emplace_back(name);
  }
}

ConnectivityCodec codec_of(const std::string& name) {
  const std::vector<std::string> names = codec_names();
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? ConnectivityCodec::automatic
                           : static_cast<ConnectivityCodec>(at - names.begin());
}

std::string format_names() {
  std::string names;
  const auto& all = formats();
  for (std::size_t f = 0; f < all.size(); ++f)
    names += (f == 0 ? "" : f + 1 < all.size() ? ", " : " or ") + std::string(all[f].name);
  return names;
}

std::string mesh_file_text() { return "File of format " + format_names(); }

std::string output_text() {
  return "File to write. A name such as out_%04d.vtu writes one file per time step, with its "
         "number;\n"
         "out.pvd writes such files into folder out, and a collection of them for ParaView";
}

}  // namespace shm::converters
