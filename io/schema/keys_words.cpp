// Key tables in the words of messages and of the reference.
#include <fmt/format.h>

#include "io/schema/keys.h"

namespace lahar {

std::string_view without_dimension(std::string_view type) {
  if (type.size() > 2 &&
      (type.substr(type.size() - 2) == "2D" || type.substr(type.size() - 2) == "3D"))
    type.remove_suffix(2);
  return type;
}

std::string allowed_kinds(const KeySpec& spec, int dim) {
  const std::string unit =
      spec.unit.empty() || spec.unit == "-" ? "" : fmt::format(" [{}]", spec.unit);
  const std::string n = dim == 0 ? "one per dimension" : fmt::format("{}", dim);
  std::vector<std::string> words;
  const auto add = [&](unsigned kind, std::string word) {
    if (spec.kinds & kind) words.push_back(std::move(word));
  };
  add(boolean, "true or false");
  add(integer, "an integer" + unit);
  add(number, "a number" + unit);
  add(text, "a text");
  add(file, "a file name");
  add(vector, fmt::format("an array of numbers ({}){}", n, unit));
  add(cell_counts, fmt::format("an array of integers ({})", n));
  add(numbers, "an array of numbers" + unit);
  add(texts, "an array of texts");
  add(object, "an object");
  add(list, "an array of objects");
  add(map, "an object of named objects");
  add(id, "an id or a name");
  add(ids, "an array of ids or names");
  add(direction, "0, 1, 2, \"x\", \"y\" or \"z\"");
  add(phase_direction, "0, 1, 2, \"x\", \"y\" or \"z\"");
  add(points, "an array of points [x, y]" + unit);
  add(places, fmt::format("an array of points ({} numbers each){}", dim == 0 ? "2 or 3" : n, unit));
  add(any, "anything");
  return join(words, " or ");
}

}  // namespace lahar
