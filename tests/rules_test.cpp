// Rules between rooms, held by reading the #include lines and a few words:
//   the container knows no hexahedra, the coders know no chunks, one file meets the operating
//   system, converters and tools see public headers only, and the library neither prints nor asks
//   clock, locale or environment.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Source {
  std::string path;                         // from the root of the project
  std::string text, code;                   // code: without comments
  std::vector<std::string> quoted, angled;  // included headers

  std::string folder() const { return fs::path(path).parent_path().string(); }
  std::string name() const { return fs::path(path).filename().string(); }
};

/// The header between `open` and `close` of an #include line.
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

/// Whether `word` stands in `code` as a word of its own.
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

bool begins_with_any(const std::string& text, std::initializer_list<const char*> heads) {
  return std::any_of(heads.begin(), heads.end(),
                     [&](const char* head) { return text.starts_with(head); });
}

/// No file in `folder` includes a header whose path begins with one of `heads`.
void expect_without(const std::string& folder, std::initializer_list<const char*> heads) {
  for (const Source& source : sources_in(folder))
    for (const std::string& header : source.quoted)
      EXPECT_FALSE(begins_with_any(header, heads)) << source.path << " includes " << header;
}

TEST(Rules, TheContainerKnowsNoHexahedra) {
  expect_without("libshmformat/src/container",
                 {"coders/", "front/", "entropy/", "values/", "mesh_"});
  for (const Source& source : sources_in("libshmformat/src/container"))
    for (const char* word : {"Stencil", "Connectivity", "ActiveSurface", "kFaceCorners"})
      EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
}

TEST(Rules, TheCodersKnowNoChunks) {
  expect_without("libshmformat/src/coders", {"container/"});
  for (const Source& source : sources_in("libshmformat/src/coders"))
    for (const char* word : {"ChunkHeader", "ChunkKind", "ChunkWriter", "GroupHeader", "Index"})
      EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
}

TEST(Rules, EachRoomStandsOnThoseBelow) {
  expect_without("libshmformat/src/bytes",
                 {"entropy/", "front/", "coders/", "container/", "values/", "mesh_"});
  expect_without("libshmformat/src/entropy",
                 {"front/", "coders/", "container/", "values/", "mesh_", "shm/"});
  expect_without("libshmformat/src/front",
                 {"entropy/", "coders/", "container/", "values/", "mesh_", "shm/"});
  expect_without("libshmformat/src/coders", {"mesh_"});
}

// Values follow a mesh cell by cell, and know nothing of how its connectivity is said.
TEST(Rules, ValuesSeeCellsOnly) {
  for (const Source& source : sources_in("libshmformat/src/values"))
    for (const std::string& header : source.quoted)
      EXPECT_TRUE(header == "coders/cell_topology.h" || header == "packing.h" ||
                  begins_with_any(header, {"values/", "bytes/", "entropy/", "front/", "shm/"}))
          << source.path << " includes " << header;
}

const std::set<std::string>& system_headers() {
  static const std::set<std::string> headers = {
      "unistd.h",  "fcntl.h",    "dirent.h", "pthread.h", "signal.h", "csignal", "termios.h",
      "windows.h", "filesystem", "fstream",  "cstdio",    "stdio.h",  "thread",  "mutex"};
  return headers;
}

TEST(Rules, OneFileOfTheLibraryMeetsTheOperatingSystem) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include"})
    for (const Source& source : sources_in(folder))
      for (const std::string& header : source.angled)
        if (header.starts_with("sys/") || system_headers().contains(header)) {
          const bool threads = header == "thread" || header == "mutex";
          const bool may =
              threads && (source.name() == "workers.h" || source.name() == "ordered_tasks.h");
          EXPECT_TRUE(may || source.path == "libshmformat/src/file_io.cpp")
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
        EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
    }
}

TEST(Rules, TheLibraryThrowsNothingAndKeepsNoGlobals) {
  for (const char* folder : {"libshmformat/src", "libshmformat/include"})
    for (const Source& source : sources_in(folder)) {
      for (const char* word : {"throw", "catch", "thread_local"}) {
        // std::thread has no other way to say that there are no more threads, and memory may run
        // out in one that no caller sees.
        const bool threads = source.name() == "workers.cpp" || source.name() == "ordered_tasks.h";
        if (threads && word == std::string("catch")) continue;
        // zstd says by a null that memory has run out; callers hear of it as of any other memory.
        if (source.name() == "packing.cpp" && word == std::string("throw")) {
          EXPECT_EQ(times(source.code, "throw "), times(source.code, "throw std::bad_alloc();"));
          continue;
        }
        EXPECT_FALSE(says(source.code, word)) << source.path << " says " << word;
      }
      // A variable that is static and not const: "static Type name =", "... name;", "... name{".
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

TEST(Rules, ConvertersAndToolsSeePublicHeadersOnly) {
  std::set<std::string> inside;  // every header of the library's inside, as it is included there
  for (const Source& source : sources_in("libshmformat/src"))
    inside.insert(source.path.substr(std::string("libshmformat/src/").size()));
  for (const Source& source : sources_in("converters"))
    for (const std::string& header : source.quoted) {
      const fs::path beside = fs::path(SHM_SOURCE_DIR) / source.folder() / header;
      EXPECT_TRUE(header.starts_with("shm/") || fs::exists(beside))
          << source.path << " includes " << header;
      EXPECT_FALSE(inside.contains(header) && !fs::exists(beside))
          << source.path << " includes " << header;
      EXPECT_EQ(header.find("libshmformat"), std::string::npos)
          << source.path << " includes " << header;
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
