#include "io/run/safety_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/base/atomic_file.h"
#include "io/json/json_text.h"
#include "io/run/table.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

constexpr int safety_format = 1;
constexpr const char* record_file = "safety.json";

constexpr std::array all_ends{SafetyTrial::End::rest, SafetyTrial::End::settles,
                              SafetyTrial::End::moved, SafetyTrial::End::restless,
                              SafetyTrial::End::broke};
constexpr std::array all_statuses{RunStatus::running, RunStatus::finished, RunStatus::failed,
                                  RunStatus::stopped};

/// The value of an enumeration that has this name.
template <class List>
std::optional<typename List::value_type> named(const List& list, const std::string& name) {
  for (const auto one : list)
    if (name == name_of(one)) return one;
  return {};
}

SafetyRecord record_of(const nlohmann::json& json) {
  SafetyRecord record;
  record.title = text_in(json, "title");
  record.divided = text_in(json, "divided");
  if (const auto program = member_of(json, "program"); program.is_object()) {
    record.version = text_in(program, "version");
    record.commit = text_in(program, "commit");
    record.compiler = text_in(program, "compiler");
  }
  if (const auto command = member_of(json, "command"); command.is_array())
    for (const auto& word : command)
      if (word.is_string()) record.command.push_back(word.get<std::string>());
  record.bounds = {.most = number_in(json, "most"), .tolerance = number_in(json, "tolerance")};
  if (const auto state = member_of(json, "equilibrium"); state.is_object())
    record.equilibrium = {text_in(state, "file"), text_in(state, "sha256")};
  if (const auto factor = member_of(json, "mechanism"); factor.is_number())
    record.mechanism = factor.get<double>();
  record.started = text_in(json, "started");
  record.ended = text_in(json, "ended");
  record.status = named(all_statuses, text_in(json, "status")).value_or(RunStatus::running);
  record.message = text_in(json, "message");
  return record;
}

}  // namespace

const char* name_of(SafetyTrial::End end) {
  switch (end) {
    case SafetyTrial::End::rest:
      return "equilibrium";
    case SafetyTrial::End::settles:
      return "settles";
    case SafetyTrial::End::moved:
      return "moved";
    case SafetyTrial::End::restless:
      return "restless";
    case SafetyTrial::End::broke:
      return "broke";
  }
  return "";
}

void SafetyResult::add(SafetyTrial trial) {
  if (trial.stable())
    stable = std::max(stable, trial.factor);
  else
    fails = std::min(fails.value_or(trial.factor), trial.factor);
  trials.push_back(std::move(trial));
}

const SafetyTrial* SafetyResult::failure() const {
  for (const SafetyTrial& trial : trials)
    if (fails && !trial.stable() && trial.factor == *fails) return &trial;
  return nullptr;
}

fs::path safety_table(const fs::path& folder) {
  return folder / "safety.csv";
}

std::string safety_table_text(const SafetyResult& result) {
  std::string text = "factor,stable,steps,displacement [m],end\n";
  for (const SafetyTrial& trial : result.trials)
    text += fmt::format("{},{},{},{},{}\n", trial.factor, trial.stable() ? 1 : 0, trial.steps,
                        trial.displacement, name_of(trial.end));
  return text;
}

SafetyResult safety_result_of(const std::string& text) {
  const Table table = table_of_text(text);
  SafetyResult result;
  const TableColumn* ends = table.find("end");
  if (!ends) return result;
  const std::vector<double> factor = table.values("factor"), steps = table.values("steps"),
                            displacement = table.values("displacement");
  for (std::size_t k = 0; k < ends->texts.size(); ++k) {
    const auto end = named(all_ends, ends->texts[k]);
    if (!end || !(factor[k] > 0) || !(std::abs(steps[k]) < 1e15)) continue;
    result.add({.factor = factor[k],
                .end = *end,
                .steps = static_cast<Index>(steps[k]),
                .displacement = displacement[k]});
  }
  return result;
}

void write_safety_record(const fs::path& folder, const SafetyRecord& record,
                         const SafetyResult& result) {
  using Json = nlohmann::ordered_json;
  const bool begun = !record.equilibrium.file.empty();
  Json json = {{"lahar_safety", safety_format},
               {"title", record.title},
               {"status", name_of(record.status)},
               {"message", record.message},
               {"factor", result.fails ? Json(result.factor()) : Json()},
               {"stable", begun ? Json(result.stable) : Json()},
               {"fails", result.fails ? Json(*result.fails) : Json()},
               {"tolerance", record.bounds.tolerance},
               {"most", record.bounds.most},
               {"divided", record.divided},
               {"mechanism", record.mechanism ? Json(*record.mechanism) : Json()},
               {"equilibrium", Json()},
               {"program",
                {{"name", "lahar"},
                 {"version", record.version},
                 {"commit", record.commit},
                 {"compiler", record.compiler}}},
               {"command", record.command},
               {"started", record.started}};
  if (begun)
    json["equilibrium"] = {{"file", record.equilibrium.file},
                           {"sha256", record.equilibrium.sha256}};
  if (!record.ended.empty()) json["ended"] = record.ended;
  write_text_file(folder / record_file,
                  json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

std::optional<SafetyResults> read_safety(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / record_file, error)) return {};
  const nlohmann::json json = json_of_text(read_text_file(folder / record_file));
  if (!json.is_object() || !json.contains("lahar_safety")) return {};
  SafetyResults found{.record = record_of(json), .result = {}};
  if (fs::is_regular_file(safety_table(folder), error))
    found.result = safety_result_of(read_text_file(safety_table(folder)));
  return found;
}

void remove_safety(const fs::path& folder) {
  for (const fs::path& file : {safety_table(folder), folder / record_file}) {
    std::error_code error;
    fs::remove(file, error);
    if (error) throw_io_error("remove", file, error.value());
  }
}

}  // namespace lahar
