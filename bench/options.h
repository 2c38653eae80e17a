// Parses the command line of a benchmark program.
#pragma once

#include <charconv>
#include <functional>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace shm::bench {

inline void set_from(std::string_view text, std::string& to) { to = text; }

template <class Number>
requires std::is_arithmetic_v<Number>
void set_from(std::string_view text, Number& to) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), to);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::runtime_error(std::string(text) + " is not a number");
}

template <class T>
void set_from(std::string_view text, std::vector<T>& to) {
  set_from(text, to.emplace_back());
}

/// A command-line option that sets the variable `to`. If `to` is a bool, the option is a flag;
/// otherwise the option has a value. If `to` is a vector, the option may occur several times, and
/// each value is appended.
struct Option {
  std::string_view name;
  bool is_flag;
  std::function<void(std::string_view)> set;

  Option(std::string_view word, bool& to)
      : name(word), is_flag(true), set([&to](std::string_view) { to = true; }) {}
  template <class T>
  Option(std::string_view word, T& to)
      : name(word), is_flag(false), set([&to](std::string_view text) { set_from(text, to); }) {}
};

/// Parses the command line and stores the values of the options. Returns the only argument that is
/// not an option: the path of a file.
inline std::string parse_options(int argc, char** argv, std::initializer_list<Option> options) {
  std::string path;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const Option* found = nullptr;
    for (const Option& option : options)
      if (option.name == word) found = &option;
    if (found == nullptr) {
      if (word.starts_with("--") || !path.empty())
        throw std::runtime_error(word + " is not understood");
      path = word;
    } else if (found->is_flag) {
      found->set({});
    } else {
      if (++i == argc) throw std::runtime_error(word + " needs a value");
      found->set(argv[i]);
    }
  }
  if (path.empty()) throw std::runtime_error("no file is named");
  return path;
}

}  // namespace shm::bench
