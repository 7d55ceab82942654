#include "io/scenario/scenario_difference.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "io/json/json_text.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array allowed_keys{
    "/title",
    "/analysis/nsteps",
    "/analysis/end_time",
    "/analysis/until",
    "/analysis/uuid",
    "/analysis/nload_balance_steps",
    "/analysis/watchdog",
    "/analysis/lost_share",
    "/analysis/linear_solver",
    "/analysis/scheme_settings/max_iteration",
    "/analysis/scheme_settings/displacement_tolerance",
    "/analysis/scheme_settings/residual_tolerance",
    "/analysis/scheme_settings/relative_residual_tolerance",
    "/post_processing",
};

bool is_allowed(std::string_view where) {
  return std::any_of(allowed_keys.begin(), allowed_keys.end(), [&](std::string_view key) {
    return where == key || (where.starts_with(key) && where.substr(key.size()).starts_with('/'));
  });
}

std::string text_of_json(const Json* value) {
  constexpr std::size_t most = 200;
  if (!value) return "not given";
  std::string text = value->dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > most) text = text.substr(0, most) + "...";
  return text;
}

void compare(const std::string& where, const Json* before, const Json* now,
             std::vector<ScenarioDifference>& found) {
  if (before && now && before->is_object() && now->is_object()) {
    for (const auto& [key, value] : before->items())
      compare(where + '/' + key, &value, now->contains(key) ? &(*now)[key] : nullptr, found);
    for (const auto& [key, value] : now->items())
      if (!before->contains(key)) compare(where + '/' + key, nullptr, &value, found);
  } else if (before && now && before->is_array() && now->is_array() &&
             before->size() == now->size()) {
    for (std::size_t i = 0; i < before->size(); ++i)
      compare(where + '/' + std::to_string(i), &(*before)[i], &(*now)[i], found);
  } else if (!before || !now || *before != *now) {
    found.push_back({where, text_of_json(before), text_of_json(now), is_allowed(where)});
  }
}

}  // namespace

std::span<const char* const> allowed_differences() {
  return allowed_keys;
}

std::vector<ScenarioDifference> differences(const std::string& before, const std::string& now) {
  std::vector<ScenarioDifference> found;
  const Json a = json_of_text<Json>(before), b = json_of_text<Json>(now);
  if (a.is_discarded()) throw IoError("the scenario in the checkpoint is not JSON");
  compare("", &a, &b, found);
  return found;
}

std::vector<ScenarioDifference> differences(const std::vector<SideFileHash>& before,
                                            const std::vector<SideFileHash>& now) {
  std::vector<ScenarioDifference> found;
  const auto show = [](const SideFileHash* side) {
    return side ? side->file + " with SHA-256 " + side->sha256 : std::string("no file");
  };
  for (std::size_t i = 0; i < std::max(before.size(), now.size()); ++i) {
    const SideFileHash* a = i < before.size() ? &before[i] : nullptr;
    const SideFileHash* b = i < now.size() ? &now[i] : nullptr;
    if (a && b && a->sha256 == b->sha256) continue;  // wherever it lies
    found.push_back({"side file " + (b ? b : a)->file, show(a), show(b), false});
  }
  return found;
}

}  // namespace lahar
