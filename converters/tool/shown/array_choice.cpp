#include "tool/shown/array_choice.h"

#include <algorithm>

#include "base/failure.h"
#include "base/text_input.h"
#include "mesh/array_names.h"
#include "tool/step_choice.h"

namespace shm::converters {
namespace {

std::vector<std::uint32_t> arrays_called(const std::string& name, const Schema& schema) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (is_on_mesh(schema.arrays[a].location) &&
        (schema.arrays[a].name == name || array_label(schema.arrays[a]) == name))
      found.push_back(a);
  return found;
}

bool is_anywhere(Location location, const std::vector<std::uint32_t>& arrays,
                 const Schema& schema) {
  return std::any_of(arrays.begin(), arrays.end(),
                     [&](std::uint32_t a) { return schema.arrays[a].location == location; });
}

// Stores the arrays with the name `name` in `choice`. Returns false if no such array exists.
bool choose_called(const std::string& name, const Schema& schema, ArrayChoice& choice) {
  std::vector<std::vector<std::uint32_t>> parts = {arrays_called(name, schema)};
  if (parts[0].empty()) {
    parts.clear();
    for (const char* axis : {"_x", "_y", "_z"})
      if (auto part = arrays_called(name + axis, schema); !part.empty())
        parts.push_back(std::move(part));
  }
  if (parts.empty()) return false;
  const bool of_points = is_anywhere(Location::point, parts[0], schema);
  if (of_points && is_anywhere(Location::cell, parts[0], schema))
    wrong_use("there are point/" + name + " and cell/" + name + "; use one of these names");
  choice.location = of_points ? Location::point : Location::cell;
  for (auto& part : parts) {
    std::erase_if(part,
                  [&](std::uint32_t a) { return schema.arrays[a].location != choice.location; });
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (i == choice.layers.size()) choice.layers.emplace_back();
      choice.layers[i].push_back(part[i]);
    }
  }
  return true;
}

[[noreturn]] void refuse_name(const std::string& name, const Schema& schema) {
  constexpr std::size_t kMost = 40;
  std::string labels;
  std::size_t count = 0;
  for (const ArrayInfo& array : schema.arrays)
    if (is_on_mesh(array.location) && ++count <= kMost)
      labels += (count > 1 ? ", " : "") + array_label(array);
  if (count > kMost) labels += ", ... (" + std::to_string(count) + ")";
  wrong_use("there is no array " + name + "; there are " + (labels.empty() ? "none" : labels));
}

}  // namespace

ArrayChoice array_named(const std::string& words, const std::string& option, const Schema& schema,
                        std::uint64_t steps) {
  ArrayChoice choice;
  std::string name = words;
  std::optional<std::string> step;
  // The name of an array may contain @. Therefore the whole text is first tried as a name, before
  // it is split at the last @.
  if (!choose_called(name, schema, choice)) {
    const std::size_t at = words.rfind('@');
    if (at == std::string::npos) refuse_name(name, schema);
    name = words.substr(0, at);
    step = words.substr(at + 1);
    if (!choose_called(name, schema, choice)) refuse_name(name, schema);
  }
  const std::size_t slash = name.find('/');
  const ArrayInfo& first = schema.arrays[choice.layers[0][0]];
  const bool is_label = !first.name.starts_with(name) && array_label(first).starts_with(name);
  choice.name = is_label ? name.substr(slash + 1) : name;
  const bool has_steps =
      std::any_of(choice.layers.begin(), choice.layers.end(), [&](const auto& layer) {
        return std::any_of(layer.begin(), layer.end(),
                           [&](std::uint32_t a) { return schema.arrays[a].per_step; });
      });
  if (!has_steps) {
    if (step) wrong_use(option + " " + words + ": " + name + " has no time steps");
    return choice;
  }
  std::uint64_t number = 0;
  if (step && *step != "first" && *step != "last" &&
      !TextInput::parse(std::string_view(*step), number))
    wrong_use(option + " " + words + ": the step must be N, from 0, first or last");
  choice.step = steps_named(step.value_or("last"), steps, "the mesh").first;
  return choice;
}

}  // namespace shm::converters
