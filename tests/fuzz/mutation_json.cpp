// Changes of JSON: values, keys and parts, with the words that the schema knows.
#include <set>

#include "io/scenario/scenario.h"
#include "io/schema/keys.h"
#include "tests/fuzz/mutation_values.h"

namespace lahar::fuzz {

namespace {

void collect(const nlohmann::json& schema, std::set<std::string>& keys,
             std::set<std::string>& words) {
  if (schema.is_object())
    for (const auto& [key, value] : schema.items()) {
      if (key == "properties" && value.is_object())
        for (const auto& property : value.items()) keys.insert(property.key());
      if ((key == "enum" || key == "const"))
        for (const auto& word : value.is_array() ? value : nlohmann::json::array({value}))
          if (word.is_string()) words.insert(word.get<std::string>());
      collect(value, keys, words);
    }
  if (schema.is_array())
    for (const auto& value : schema) collect(value, keys, words);
}

/// All values in a document, the document first.
void nodes_of(Json& json, std::vector<Json*>& nodes) {
  nodes.push_back(&json);
  if (json.is_structured())
    for (auto& value : json) nodes_of(value, nodes);
}

Json other_value(const Json& old, const std::vector<std::string>& words, Random& random) {
  switch (below(10, random)) {
    case 0:
      return any_of(integers, random);
    case 1:
      return any_of(doubles, random);
    case 2:
      return any_of(texts, random);
    case 3:
      return any_of(words, random);
    case 4:
      return one_in(2, random);
    case 5:
      return one_in(2, random) ? Json::array() : Json::object();
    case 6:
      return nullptr;
    default:
      break;
  }
  if (old.is_boolean()) return !old.get<bool>();
  if (old.is_number()) {
    const double value = old.get<double>();
    switch (below(6, random)) {
      case 0:
        return -value;
      case 1:
        return value * 10;
      case 2:
        return value * 0.1;
      case 3:
        return value + 1;
      case 4:
        return any_of(doubles, random);
      default:
        return any_of(integers, random);
    }
  }
  if (old.is_string()) return any_of(words, random);
  return any_of(doubles, random);
}

/// Changes one value, or a key, in place.
void change(Json& json, Json& other, const std::vector<std::string>& keys,
            const std::vector<std::string>& words, Random& random) {
  std::vector<Json*> nodes;
  nodes_of(json, nodes);
  Json& node = *any_of(nodes, random);
  switch (below(10, random)) {
    case 0:  // a part goes
      if (node.is_object() && !node.empty()) {
        auto at = node.begin();
        std::advance(at, static_cast<std::ptrdiff_t>(below(node.size(), random)));
        node.erase(at);
      } else if (node.is_array() && !node.empty()) {
        node.erase(below(node.size(), random));
      }
      return;
    case 1:  // a part is there twice
      if (node.is_array() && !node.empty() && node.size() < 64) {
        const Json copy = node[below(node.size(), random)];
        node.push_back(copy);
      }
      return;
    case 2:  // a key that the input knows
      if (node.is_object()) node[any_of(keys, random)] = other_value(nullptr, words, random);
      return;
    case 3: {  // a part of another input
      std::vector<Json*> lent;
      nodes_of(other, lent);
      const Json copy = *any_of(lent, random);
      if (node.is_object())
        node[any_of(keys, random)] = copy;
      else
        node = copy;
      return;
    }
    case 4:  // values change places
      std::swap(node, *any_of(nodes, random));
      return;
    default:
      if (node.is_structured() && !one_in(8, random)) return;
      node = other_value(node, words, random);
  }
}

}  // namespace

Mutator::Mutator() {
  std::set<std::string> keys, words;
  collect(nlohmann::json::parse(scenario_schema()), keys, words);
  keys_.assign(keys.begin(), keys.end());
  words_.assign(words.begin(), words.end());
}

std::string Mutator::mutate_json(const std::string& text, const std::string& other,
                                 Random& random) const {
  Json json = Json::parse(text, nullptr, false, true);
  if (json.is_discarded()) return mutate_text(text, random);
  Json lender = Json::parse(other, nullptr, false, true);
  // An object cannot change while a part of it is moved into another part of it.
  for (std::size_t k = 0, n = one_in(3, random) ? 1 + below(4, random) : 1; k < n; ++k)
    change(json, lender, keys_, words_, random);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lahar::fuzz
