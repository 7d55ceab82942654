// Results of `lahar bench` as JSON, and back.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "io/base/text.h"
#include "io/json/json_text.h"
#include "physics/base/error.h"
#include "runtime/bench/bench_result.h"

namespace lahar {

double BenchSamples::median() const {
  if (values.empty()) return 0;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : std::midpoint(sorted[half - 1], sorted[half]);
}

double BenchSamples::min() const {
  return values.empty() ? 0 : *std::min_element(values.begin(), values.end());
}

double BenchSamples::max() const {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

double BenchRates::bandwidth() const {
  return std::max(triad.max(), update.max());
}

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format_key = "lahar_bench";
constexpr int format_version = 1;

/// The members of every struct, once for both directions: `io(key, member)`.
template <class Io>
void members(Io& io, BenchSamples& s) {
  io("samples", s.values);
}
template <class Io>
void members(Io& io, BenchRates& s) {
  io("threads", s.threads);
  io("triad_bytes_per_second", s.triad);
  io("update_bytes_per_second", s.update);
  io("multiply_add_flops", s.multiply);
}
template <class Io>
void members(Io& io, BenchMachine& s) {
  io("cpu", s.cpu);
  io("cores", s.cores);
  io("caches", s.caches);
  io("memory_bytes", s.memory);
  io("governor", s.governor);
  io("transparent_huge_pages", s.huge_pages);
  io("kernel", s.kernel);
  io("load", s.load);
  io("rates", s.rates);
}
template <class Io>
void members(Io& io, BenchProtocol& s) {
  io("repeats", s.repeats);
  io("sample_seconds", s.sample_seconds);
  io("steps", s.steps);
  io("threads", s.threads);
}
template <class Io>
void members(Io& io, BenchStage& s) {
  io("name", s.name);
  io("ns_per_particle_step", s.ns);
}
template <class Io>
void members(Io& io, BenchVariant& s) {
  io("name", s.name);
  io("threads", s.threads);
  io("copies", s.copies);
  io("particles", s.particles);
  io("cells", s.cells);
  io("patches", s.patches);
  io("steps", s.steps);
  io("ns_per_particle_step", s.ns);
  io("cpu_ns_per_particle_step", s.cpu_ns);
  io("goal_ns", s.goal);
  io("modelled_bytes_per_particle_step", s.bytes);
  io("bandwidth_bound_ns", s.bound);
  io("particles_per_cell_mean", s.per_cell);
  io("particles_per_cell_deviation", s.per_cell_spread);
  io("crossings_per_particle_step", s.crossings);
  io("stages", s.stages);
}
template <class Io>
void members(Io& io, BenchFigure& s) {
  io("name", s.name);
  io("unit", s.unit);
  io("value", s.samples);
  io("ratio_of_medians", s.of_medians);
  io("goal_at_most", s.at_most);
  io("goal_at_least", s.at_least);
}
template <class Io>
void members(Io& io, BenchCase& s) {
  io("name", s.name);
  io("title", s.title);
  io("variants", s.variants);
  io("figures", s.figures);
}
template <class Io>
void members(Io& io, BenchResult& s) {
  io("date", s.date);
  io("version", s.version);
  io("build", s.build);
  io("machine", s.machine);
  io("protocol", s.protocol);
  io("cases", s.cases);
}

template <class T>
inline constexpr bool is_list = false;
template <class T>
inline constexpr bool is_list<std::vector<T>> = true;

template <class T>
Json to_tree(const T& value);

struct Writer {
  Json json = Json::object();
  template <class T>
  void operator()(const char* key, const T& value) {
    json[key] = to_tree(value);
  }
};

template <class T>
Json to_tree(const T& value) {
  if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    return value;
  } else if constexpr (is_list<T>) {
    Json list = Json::array();
    for (const auto& item : value) list.push_back(to_tree(item));
    return list;
  } else {
    Writer writer;
    if constexpr (std::is_same_v<T, BenchSamples>)  // for readers; only samples are read back
      writer.json = {{"median", value.median()}, {"min", value.min()}, {"max", value.max()}};
    T copy = value;  // members() is for both directions
    members(writer, copy);
    return writer.json;
  }
}

/// What does not fit, with its place: "/cases/0/name".
struct Mismatch {
  std::string what;
};

template <class T>
void from_tree(const Json& json, const std::string& place, T& value);

struct Reader {
  const Json& json;
  const std::string& place;
  template <class T>
  void operator()(const char* key, T& value) {
    const std::string at = place + "/" + key;
    const auto found = json.find(key);
    if (found == json.end()) throw Mismatch{at + " is missing"};
    from_tree(*found, at, value);
  }
};

template <class T>
void from_tree(const Json& json, const std::string& place, T& value) {
  if constexpr (std::is_arithmetic_v<T>) {
    if (!json.is_number()) throw Mismatch{place + " is not a number"};
    value = json.get<T>();
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!json.is_string()) throw Mismatch{place + " is not a text"};
    value = printable(json.get<std::string>());  // it may be of anyone
  } else if constexpr (is_list<T>) {
    if (!json.is_array()) throw Mismatch{place + " is not a list"};
    for (const Json& item : json) {
      value.emplace_back();
      from_tree(item, fmt::format("{}/{}", place, value.size() - 1), value.back());
    }
  } else {
    if (!json.is_object()) throw Mismatch{place + " is not an object"};
    Reader reader{json, place};
    members(reader, value);
  }
}

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
  throw InputError({Problem{.file = file,
                            .message = "not a result of lahar bench: " + why,
                            .hint = "lahar bench --json FILE writes one"}});
}

}  // namespace

std::string bench_json(const BenchResult& result) {
  Json json = {{format_key, format_version}};
  const Json rest = to_tree(result);
  json.update(rest);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

BenchResult parse_bench_json(const std::string& text, const std::string& file) {
  const Json json = json_of_text<Json>(text);
  if (json.is_discarded()) refuse(file, "it is not JSON");
  if (!json.is_object() || !json.contains(format_key))
    refuse(file, fmt::format("\"{}\" is missing", format_key));
  if (json[format_key] != format_version)
    refuse(file, fmt::format("its format is {}, this program reads {}", json[format_key].dump(),
                             format_version));
  BenchResult result;
  try {
    from_tree(json, "", result);
  } catch (const Mismatch& mismatch) {
    refuse(file, mismatch.what);
  }
  return result;
}

}  // namespace lahar
