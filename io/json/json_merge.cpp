#include "io/json/json_merge.h"

#include <algorithm>

namespace lahar {

void merge_patch(JsonValue& target, const JsonValue& patch) {
  if (!patch.is<JsonValue::Object>()) {
    target = patch;
    return;
  }
  if (!target.is<JsonValue::Object>()) {
    target = patch;
    target.data = JsonValue::Object{};
  }
  auto& members = std::get<JsonValue::Object>(target.data);
  for (const JsonValue::Member& change : patch.as<JsonValue::Object>()) {
    auto at = std::find_if(members.begin(), members.end(),
                           [&](const JsonValue::Member& m) { return m.key == change.key; });
    if (change.value.is<JsonValue::Null>()) {
      if (at != members.end()) members.erase(at);
      continue;
    }
    if (at == members.end()) at = members.insert(at, {change.key, change.offset, {}});
    if (!at->value.is<JsonValue::Object>() || !change.value.is<JsonValue::Object>())
      at->offset = change.offset;
    merge_patch(at->value, change.value);
  }
}

}  // namespace lahar
