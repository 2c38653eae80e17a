// Checks rules for modules (folders of sources) by searching the sources for #include lines and for
// a few words:
// - A module includes only the modules that a table allows.
// - The number of files in a module is limited.
// - Only one file uses the headers of each operating system.
// - A module defines the functions that its headers declare.
// - The library neither prints nor reads the clock, the locale or the environment.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Source {
  std::string path;                         // from the root of the project
  std::string text, code;                   // code: the text without comments
  std::vector<std::string> quoted, angled;  // included headers

  std::string folder() const { return fs::path(path).parent_path().string(); }
  std::string name() const { return fs::path(path).filename().string(); }
};

/// Returns the path between `open` and `close` in an #include line.
std::string header_in(const std::string& line, char open, char close) {
  const std::size_t begin = line.find(open), end = line.rfind(close);
  return begin == std::string::npos || end <= begin ? "" : line.substr(begin + 1, end - begin - 1);
}

std::vector<Source> sources_in(const std::string& folder) {
  const fs::path root = SHM_SOURCE_DIR;
  std::vector<Source> sources;
  for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cpp") continue;
    Source source;
    source.path = fs::relative(entry.path(), root).generic_string();
    std::ifstream in(entry.path());
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("#include")) {
        const std::string quoted = header_in(line, '"', '"'), angled = header_in(line, '<', '>');
        if (!quoted.empty()) source.quoted.push_back(quoted);
        if (!angled.empty()) source.angled.push_back(angled);
      }
      source.text += line + '\n';
      source.code += line.substr(0, line.find("//")) + '\n';
    }
    sources.push_back(std::move(source));
  }
  EXPECT_FALSE(sources.empty()) << folder;
  return sources;
}

std::size_t times(const std::string& code, const std::string& words) {
  std::size_t count = 0;
  for (auto at = code.find(words); at != code.npos; at = code.find(words, at + 1)) ++count;
  return count;
}

/// Returns true if `word` occurs in `code` as a whole word.
bool says(const std::string& code, const std::string& word) {
  const auto part_of_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  for (std::size_t at = code.find(word); at != std::string::npos; at = code.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !part_of_word(code[at - 1])) &&
        (end == code.size() || !part_of_word(code[end])))
      return true;
  }
  return false;
}

// The modules of the two source trees, each with the modules that it may include. Modules are
// listed from the lowest to the highest, and a module may include only modules that are listed
// before it. A folder that is not listed is not a module.
struct Module {
  std::string folder;
  std::set<std::string> may_include;
};

struct Tree {
  std::string root;
  std::vector<Module> modules;
};

const std::vector<Tree>& trees() {
  static const std::vector<Tree> all = {
      {"libshmformat/src",
       {
           {"base", {}},
           {"io", {"base"}},
           {"format", {"base"}},
           {"entropy", {"base"}},
           {"mesh", {"base"}},
           {"codecs/shared", {"base", "entropy", "format", "mesh"}},
           {"codecs/paper", {"base", "entropy", "mesh", "codecs/shared"}},
           {"codecs/surface/cells", {"base", "entropy", "mesh", "codecs/shared", "codecs/paper"}},
           {"codecs/surface/values", {"base", "entropy", "mesh", "codecs/shared"}},
           {"codecs/surface/plan", {"base", "entropy", "codecs/shared", "codecs/surface/values"}},
           {"codecs/surface",
            {"base", "entropy", "format", "mesh", "codecs/shared", "codecs/surface/cells",
             "codecs/surface/values", "codecs/surface/plan"}},
           {"codecs/shifts",
            {"base", "entropy", "format", "mesh", "codecs/shared", "codecs/surface/cells",
             "codecs/surface/values", "codecs/surface/plan", "codecs/surface"}},
           {"codecs/patterns",
            {"base", "entropy", "format", "mesh", "codecs/shared", "codecs/surface/cells",
             "codecs/surface/values", "codecs/surface", "codecs/shifts"}},
           {"codecs/bundles", {"base", "codecs/shared", "codecs/patterns", "codecs/shifts"}},
           {"codecs/weighted",
            {"base", "codecs/shared", "codecs/surface/values", "codecs/surface/plan",
             "codecs/shifts"}},
           {"codecs",
            {"base", "format", "codecs/shared", "codecs/surface", "codecs/shifts",
             "codecs/patterns"}},
           {"boundary", {"base", "mesh"}},
           {"pipeline",
            {"base", "entropy", "format", "mesh", "codecs/shared", "codecs/surface/cells",
             "codecs"}},
           {"steps",
            {"base", "format", "codecs/shared", "codecs/surface/values", "codecs/surface/plan",
             "codecs/shifts", "codecs/patterns", "codecs/bundles", "codecs/weighted", "codecs"}},
           {"repair", {"base", "format"}},
           {"random", {"base", "format", "codecs/shared", "codecs", "steps", "repair"}},
           {"api",
            {"base", "io", "format", "codecs/shared", "codecs", "boundary", "pipeline", "steps",
             "repair", "random"}},
       }},
      {"converters",
       {
           {"base", {}},
           {"picture", {"base"}},
           {"openmesh", {"base", "picture"}},
           {"mesh", {"base"}},
           {"accuracy", {"base", "mesh"}},
           {"order", {"base", "mesh"}},
           {"sets", {"base", "mesh"}},
           {"interface", {"base", "mesh", "sets"}},
           {"exodus", {"base", "mesh", "sets", "interface"}},
           {"exodus/parts", {"base", "mesh", "sets", "exodus"}},
           {"gmsh", {"base", "mesh", "sets", "interface"}},
           {"ucd", {"base", "mesh", "interface"}},
           {"vtk", {"base", "mesh"}},
           {"vtk/between", {"base", "mesh", "interface", "vtk"}},
           {"vtk/legacy", {"base", "mesh", "interface", "vtk", "vtk/between"}},
           {"vtk/xml", {"base", "mesh", "interface", "vtk", "vtk/between"}},
           {"formats",
            {"base", "mesh", "interface", "exodus", "exodus/parts", "gmsh", "ucd", "vtk/legacy",
             "vtk/xml"}},
           {"transfer", {"base", "mesh", "accuracy", "sets", "interface", "formats"}},
           {"compression", {"base", "mesh", "accuracy", "order", "sets", "interface", "formats"}},
           {"files", {"base", "mesh", "interface", "formats", "compression"}},
           {"compare",
            {"base", "mesh", "accuracy", "order", "interface", "formats", "compression"}},
           {"archive",
            {"base", "mesh", "accuracy", "order", "interface", "formats", "transfer", "compression",
             "files", "compare"}},
           {"series",
            {"base", "mesh", "interface", "formats", "files", "compare", "archive", "vtk/xml"}},
           {"tool",
            {"base", "picture", "mesh", "accuracy", "order", "sets", "interface", "formats",
             "transfer", "compression", "files", "compare", "archive", "series"}},
           {"tool/help", {}},
           {"tool/running", {"base", "interface", "formats", "archive", "tool", "tool/help"}},
           {"tool/shown",
            {"base", "picture", "mesh", "interface", "compression", "archive", "tool"}},
           {"tool/drawing",
            {"base", "picture", "openmesh", "mesh", "order", "interface", "compression", "archive",
             "series", "tool", "tool/running", "tool/shown"}},
           {"tool/commands",
            {"base", "mesh", "accuracy", "order", "sets", "interface", "formats", "transfer",
             "compression", "files", "compare", "archive", "series", "tool", "tool/help",
             "tool/running", "tool/shown", "tool/drawing"}},
           {"mpi",
            {"base", "mesh", "accuracy", "sets", "interface", "formats", "transfer", "exodus",
             "exodus/parts", "compression", "files", "tool", "tool/running", "tool/commands"}},
           {"programs", {"base", "mesh", "files"}},
       }},
  };
  return all;
}

std::string folder_of(const std::string& path) { return fs::path(path).parent_path().string(); }

// A module may include only modules that are listed before it. Cycles are therefore impossible.
TEST(Rules, ModulesIncludeOnlyModulesAboveThem) {
  for (const Tree& tree : trees()) {
    std::set<std::string> above;
    for (const Module& module : tree.modules) {
      for (const std::string& other : module.may_include)
        EXPECT_TRUE(above.contains(other)) << module.folder << " may include " << other;
      EXPECT_TRUE(above.insert(module.folder).second) << module.folder << " is listed twice";
    }
  }
}

// The modules include each other only as the table allows, and every source belongs to a module.
TEST(Rules, EachModuleIncludesOnlyWhatItMay) {
  for (const Tree& tree : trees()) {
    std::map<std::string, const Module*> modules;
    for (const Module& module : tree.modules) modules[module.folder] = &module;
    for (const Source& source : sources_in(tree.root)) {
      const std::string folder = folder_of(source.path.substr(tree.root.size() + 1));
      ASSERT_TRUE(modules.contains(folder))
          << source.path << " is in a folder without a line in the table";
      for (const std::string& header : source.quoted) {
        if (header.starts_with("shm/")) continue;
        const std::string other = folder_of(header);
        EXPECT_TRUE(other == folder || modules[folder]->may_include.contains(other))
            << source.path << " includes " << header;
      }
    }
  }
}

// A module has three to thirty files: enough to justify a folder, and few enough for a reader to
// get an overview.
TEST(Rules, ModulesHoldThreeToThirtyFiles) {
  for (const char* root : {"libshmformat/src", "libshmformat/include", "converters", "tests"}) {
    std::map<std::string, std::size_t> files;
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SHM_SOURCE_DIR) / root)) {
      const std::string extension = entry.path().extension().string();
      if (entry.is_regular_file() &&
          (extension == ".h" || extension == ".cpp" || extension == ".py" || extension == ".txt"))
        ++files[entry.path().parent_path().generic_string()];
    }
    for (const auto& [folder, count] : files) {
      if (folder.find("/tests/golden/") != std::string::npos) continue;  // data
      EXPECT_LE(count, 30u) << folder;
      EXPECT_TRUE(count >= 3 || fs::path(folder).filename() == root) << folder;
    }
  }
}

// Every module may include those public headers that only define values and functions of them. The
// other public headers declare classes and functions that the module api/ implements, so only api/
// may include them.
TEST(Rules, OnlyTheTopModuleIncludesVerbs) {
  const std::set<std::string> values = {"shm/blocks.h", "shm/cell_nodes.h", "shm/damage_report.h",
                                        "shm/io.h",     "shm/limits.h",     "shm/options.h",
                                        "shm/result.h", "shm/schema.h",     "shm/selection.h",
                                        "shm/surface.h"};
  const std::string root = "libshmformat/src/";
  for (const Source& source : sources_in("libshmformat/src")) {
    const std::string path = source.path.substr(root.size());
    if (folder_of(path) == "api") continue;
    for (const std::string& header : source.quoted)
      EXPECT_TRUE(!header.starts_with("shm/") || values.contains(header))
          << path << " includes " << header;
  }
}

/// Finds the free functions that a source declares, and the free functions that it defines with
/// external linkage. Names include namespaces: "shm::converters::open_mesh". Only statements
/// directly inside namespaces are examined; the bodies of functions and classes are skipped.
/// Templates, operators and members are ignored.
class FreeFunctions {
 public:
  std::set<std::string> declared, defined;

  explicit FreeFunctions(const Source& source) : code_(without_literals(source.code)) {
    std::string statement;
    for (at_ = 0; at_ < code_.size(); ++at_) {
      const char c = code_[at_];
      depth_ += (c == '(') - (c == ')');
      if (c == '#' && blank(statement)) {
        skip_directive();
      } else if (depth_ > 0 || (c != ';' && c != '{' && c != '}')) {
        statement += c;
      } else {
        end(statement, c);
        statement.clear();
      }
    }
  }

 private:
  static bool blank(const std::string& text) {
    return text.find_first_not_of(" \n") == std::string::npos;
  }

  /// Removes the contents of string and character literals, which may contain braces.
  static std::string without_literals(const std::string& code) {
    std::string out;
    for (std::size_t i = 0; i < code.size(); ++i) {
      const char quote = code[i];
      out += quote;
      const bool separator = i > 0 && std::isdigit(static_cast<unsigned char>(code[i - 1])) != 0;
      if (quote != '"' && (quote != '\'' || separator)) continue;
      if (quote == '"' && i > 0 && code[i - 1] == 'R') {
        const std::string tail = ')' + code.substr(i + 1, code.find('(', i) - i - 1) + '"';
        const std::size_t close = code.find(tail, i);
        if (close == std::string::npos) break;
        i = close + tail.size() - 1;
      } else {
        for (++i; i < code.size() && code[i] != quote; ++i) i += code[i] == '\\';
      }
      out += quote;
    }
    return out;
  }

  void skip_directive() {
    while (at_ < code_.size() && (code_[at_] != '\n' || code_[at_ - 1] == '\\')) ++at_;
  }

  void end(const std::string& statement, char with) {
    if (with == '}') {
      if (!namespaces_.empty()) namespaces_.pop_back();
    } else if (with == '{' && says(statement, "namespace")) {
      std::istringstream words(statement);
      std::string name;
      while (words >> name) continue;
      namespaces_.push_back(name);  // "namespace" if it has no name
    } else if (with == '{' && says(statement, "extern") &&
               statement.find('(') == std::string::npos) {
      namespaces_.push_back("");  // extern "C"
    } else {
      if (const std::string name = function_in(statement); !name.empty())
        (with == '{' ? defined : declared).insert(name);
      if (with == '{') skip_body();
    }
  }

  void skip_body() {
    for (int open = 1; open > 0 && ++at_ < code_.size();)
      open += (code_[at_] == '{') - (code_[at_] == '}');
  }

  /// Returns the name of the declared free function, including its namespaces. Returns an empty
  /// string if the statement declares no free function, or a function with internal linkage.
  std::string function_in(const std::string& statement) const {
    for (const char* other :
         {"template", "operator", "static", "using", "class", "struct", "friend"})
      if (says(statement, other)) return {};
    std::size_t end = 0;
    for (int angles = 0; end < statement.size(); ++end) {
      const char c = statement[end];
      if (c == '=') return {};  // a variable
      angles += (c == '<') - (c == '>');
      if (c == '(' && angles == 0) break;
    }
    std::size_t begin = std::min(end, statement.size());
    const auto in_name = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == ':' || c == '~';
    };
    while (begin > 0 && in_name(statement[begin - 1])) --begin;
    const std::string name = statement.substr(begin, end - begin);
    // In constructors and macro calls, no type precedes the name.
    if (end == statement.size() || name.empty() || blank(statement.substr(0, begin)) ||
        name.find(':') != std::string::npos)
      return {};
    std::string full;
    for (const std::string& outer : namespaces_) {
      if (outer == "namespace") return {};
      if (!outer.empty()) full += outer + "::";
    }
    return full + name;
  }

  const std::string code_;
  std::size_t at_ = 0;
  int depth_ = 0;  // of parentheses
  std::vector<std::string> namespaces_;
};

// A function that a header declares must be defined in the module of the header. The #include lines
// then show all modules that a module depends on. Declared functions without a definition in the
// sources are ignored, because the build generates their definitions.
TEST(Rules, ModulesDefineWhatTheirHeadersDeclare) {
  for (const Tree& tree : trees()) {
    std::map<std::string, std::set<std::string>> declared, defined;  // functions: their folders
    for (const Source& source : sources_in(tree.root)) {
      const FreeFunctions functions(source);
      for (const std::string& name : functions.defined) defined[name].insert(source.folder());
      if (!source.name().ends_with(".h")) continue;
      for (const std::string& name : functions.declared) declared[name].insert(source.folder());
    }
    EXPECT_GT(declared.size(), 50u) << tree.root;
    for (const auto& [name, folders] : declared)
      for (const std::string& folder : folders)
        EXPECT_TRUE(defined[name].empty() || defined[name].contains(folder))
            << folder << " declares " << name << ", which " << *defined[name].begin() << " defines";
  }
}

// A unit (a source with its header) must not include itself, neither directly nor through other
// units.
TEST(Rules, NoUnitIncludesItself) {
  for (const Tree& tree : trees()) {
    const auto unit_of = [](const std::string& path) {
      return fs::path(path).replace_extension().generic_string();
    };
    std::map<std::string, std::set<std::string>> includes;
    for (const Source& source : sources_in(tree.root)) {
      const std::string unit = unit_of(source.path.substr(tree.root.size() + 1));
      for (const std::string& header : source.quoted)
        if (!header.starts_with("shm/") && unit_of(header) != unit)
          includes[unit].insert(unit_of(header));
    }
    for (const auto& [unit, direct] : includes) {
      std::set<std::string> reached;
      std::vector<std::string> next(direct.begin(), direct.end());
      while (!next.empty()) {
        const std::string one = next.back();
        next.pop_back();
        if (reached.insert(one).second)
          next.insert(next.end(), includes[one].begin(), includes[one].end());
      }
      EXPECT_FALSE(reached.contains(unit)) << tree.root << "/" << unit << " includes itself";
    }
  }
}

TEST(Rules, TheContainerKnowsNoHexahedra) {
  for (const Source& source : sources_in("libshmformat/src/format"))
    for (const char* word : {"Stencil", "Connectivity", "ActiveSurface", "kFaceCorners"})
      EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
}

TEST(Rules, TheCodersKnowNoChunks) {
  for (const char* module : {"codecs/paper", "codecs/surface/cells", "codecs/surface/values",
                             "codecs/surface/plan", "entropy", "mesh"})
    for (const Source& source : sources_in(std::string("libshmformat/src/") + module))
      for (const char* word : {"ChunkHeader", "ChunkKind", "ChunkWriter", "GroupHeader", "Index"})
        EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
}

// Decoders must not include the planner, which makes the decisions of the encoder. A programmer can
// therefore understand a decoder without the planner.
TEST(Rules, OnlyEncodersIncludeThePlanner) {
  const std::string root = "libshmformat/src/", plan = "codecs/surface/plan";
  const std::set<std::string> encoders = {
      "codecs/surface/mesh_streams.cpp", "codecs/surface/surface_segment_encoder.h",
      "codecs/shifts/shift_segment_encoder.h", "codecs/weighted/length_encoder.cpp",
      "steps/step_encoder.h"};
  for (const Source& source : sources_in("libshmformat/src")) {
    const std::string path = source.path.substr(root.size());
    if (folder_of(path) == plan) continue;
    for (const std::string& header : source.quoted)
      EXPECT_TRUE(folder_of(header) != plan || encoders.contains(path))
          << path << " includes " << header;
  }
}

// The C interface uses only headers that are installed with the library.
TEST(Rules, TheCInterfaceStandsOnThePublicHeaders) {
  for (const Source& source : sources_in("bindings/c/src")) {
    for (const std::string& header : source.quoted) {
      const bool own = fs::exists(fs::path(SHM_SOURCE_DIR) / "bindings/c/src" / header);
      EXPECT_TRUE(own || header == "shmformat.h" || header.starts_with("shm/"))
          << source.path << " includes " << header;
    }
    for (const char* word : {"printf", "fprintf", "cout", "cerr", "getenv", "setlocale", "exit"})
      EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
  }
}

const std::set<std::string>& system_headers() {
  static const std::set<std::string> headers = {
      "unistd.h",  "fcntl.h",   "dirent.h", "pthread.h",         "signal.h", "csignal",
      "termios.h", "windows.h", "io.h",     "filesystem",        "fstream",  "cstdio",
      "stdio.h",   "thread",    "mutex",    "condition_variable"};
  return headers;
}

TEST(Rules, OneFileForEachOperatingSystemMeetsIt) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include"})
    for (const Source& source : sources_in(folder))
      for (const std::string& header : source.angled)
        if (header.starts_with("sys/") || system_headers().contains(header)) {
          const bool threads =
              header == "thread" || header == "mutex" || header == "condition_variable";
          EXPECT_TRUE((threads && source.path == "libshmformat/src/base/threads.h") ||
                      source.path == "libshmformat/src/io/io_posix.cpp" ||
                      source.path == "libshmformat/src/io/io_windows.cpp")
              << source.path << " includes " << header;
        }
}

TEST(Rules, TheLibraryNeitherPrintsNorAsks) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include"})
    for (const Source& source : sources_in(folder)) {
      for (const std::string& header : source.angled)
        for (const char* banned : {"iostream", "ostream", "sstream", "print", "syncstream",
                                   "chrono", "ctime", "time.h", "clocale", "locale", "random"})
          EXPECT_NE(header, banned) << source.path;
      for (const char* word :
           {"printf",     "fprintf",      "puts",          "fputs",        "putchar",
            "cout",       "cerr",         "clog",          "getenv",       "setlocale",
            "localeconv", "gettimeofday", "clock_gettime", "system_clock", "steady_clock",
            "abort",      "exit",         "rand",          "srand",        "strtod",
            "atof",       "stod"})
        EXPECT_FALSE(says(source.code, word)) << source.path << " uses " << word;
    }
}

TEST(Rules, TheLibraryThrowsNothingAndKeepsNoGlobals) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include"})
    for (const Source& source : sources_in(folder)) {
      for (const char* word : {"throw", "catch", "thread_local"}) {
        // If the system cannot start a thread, std::thread throws an exception. If memory runs out
        // in a worker thread, the exception cannot propagate to a caller. These sources may
        // therefore catch exceptions.
        const bool threads = source.name() == "workers.cpp" || source.name() == "ordered_tasks.h";
        if (threads && word == std::string("catch")) continue;
        // If memory runs out, zstd returns a null pointer. This source file throws std::bad_alloc
        // in that case, so that callers handle the failure like any other failed allocation.
        if (source.name() == "packing.cpp" && word == std::string("throw")) {
          EXPECT_EQ(times(source.code, "throw "), times(source.code, "throw std::bad_alloc();"));
          continue;
        }
        EXPECT_FALSE(says(source.code, word)) << source.path << " uses " << word;
      }
      // Finds static variables that are not const: "static Type name =", "... name;", "... name{".
      std::istringstream lines(source.code);
      for (std::string line; std::getline(lines, line);) {
        const bool variable = says(line, "static") && !says(line, "constexpr") &&
                              !says(line, "const") && line.find('(') == std::string::npos &&
                              line.find(';') != std::string::npos;
        EXPECT_FALSE(variable) << source.path << ": " << line;
      }
    }
}

TEST(Rules, PublicHeadersIncludePublicHeadersOnly) {
  for (const Source& source : sources_in("libshmformat/include")) {
    for (const std::string& header : source.quoted)
      EXPECT_TRUE(header.starts_with("shm/")) << source.path << " includes " << header;
    for (const std::string& header : source.angled)
      EXPECT_EQ(header.find('.'), std::string::npos) << source.path << " includes " << header;
  }
}

TEST(Rules, EveryHeaderGuardsItself) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include", "converters"})
    for (const Source& source : sources_in(folder)) {
      if (!source.name().ends_with(".h")) continue;
      EXPECT_NE(source.text.find("#pragma once"), std::string::npos) << source.path;
    }
}

}  // namespace
