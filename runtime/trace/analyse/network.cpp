#include "runtime/trace/analyse/network.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "io/json/json_source.h"

namespace lahar {

namespace {

struct Unit {
  std::string_view name;
  double size;
};
constexpr std::array times{Unit{"ns", 1e-9}, Unit{"us", 1e-6}, Unit{"ms", 1e-3}, Unit{"s", 1.0}};
constexpr std::array rates{Unit{"B/s", 1.0},       Unit{"kB/s", 1e3},  Unit{"MB/s", 1e6},
                           Unit{"GB/s", 1e9},      Unit{"TB/s", 1e12}, Unit{"Mbit/s", 1e6 / 8},
                           Unit{"Gbit/s", 1e9 / 8}};

/// The value of "2us"; nothing if it is no number with one of the units.
template <std::size_t N>
std::optional<double> with_unit(const std::string& text, const std::array<Unit, N>& units) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return {};
  std::string_view unit(end);
  while (unit.starts_with(' ')) unit.remove_prefix(1);
  for (const Unit& u : units)
    if (unit == u.name) return number * u.size;
  return {};
}

class Reader {
 public:
  Reader(const JsonDocument& document, ProblemList& problems)
      : document_(document), problems_(problems) {}

  Network read() {
    const std::vector<std::string> keys{"latency", "bandwidth", "overhead", "ideal"};
    Network network;
    if (!document_.root.is<JsonValue::Object>()) {
      problems_.error(document_.at(
          document_.root, "a network is an object, not " + describe(document_.root), example));
      return network;
    }
    for (const auto& member : document_.root.as<JsonValue::Object>()) {
      if (member.key == "latency") {
        network.latency = time(member);
      } else if (member.key == "overhead") {
        network.overhead = time(member);
      } else if (member.key == "bandwidth") {
        network.bandwidth = rate(member);
      } else if (member.key == "ideal") {
        if (!member.value.is<bool>())
          problems_.error(document_.at(
              member.value, "\"ideal\" is true or false, not " + describe(member.value), ""));
        else if (member.value.as<bool>())
          network = Network::ideal();
      } else {
        problems_.error(document_.at_key(document_.root, member,
                                         fmt::format("unknown key \"{}\"", member.key),
                                         suggest(member.key, keys, "keys of a network")));
      }
    }
    return network;
  }

 private:
  static constexpr const char* example = R"(for example {"latency": "2us", "bandwidth": "10GB/s"})";

  template <std::size_t N>
  std::optional<double> number(const JsonValue::Member& member, const std::array<Unit, N>& units,
                               const char* what, const char* hint, bool zero) {
    std::optional<double> value;
    if (member.value.is_number()) value = member.value.number();
    if (member.value.is<std::string>()) value = with_unit(member.value.as<std::string>(), units);
    if (value && std::isfinite(*value) && (zero ? *value >= 0 : *value > 0)) return value;
    problems_.error(document_.at(
        member.value, fmt::format("\"{}\" is {}, not {}", member.key, what, describe(member.value)),
        hint));
    return {};
  }
  std::optional<double> time(const JsonValue::Member& member) {
    return number(member, times, "a time, zero or more",
                  "a number of seconds, or a text with ns, us, ms or s: \"2us\"", true);
  }
  std::optional<double> rate(const JsonValue::Member& member) {
    return number(
        member, rates, "a rate above zero",
        "a number of bytes per second, or a text with B/s, kB/s, MB/s, GB/s, TB/s, Mbit/s "
        "or Gbit/s: \"10GB/s\"",
        false);
  }

  const JsonDocument& document_;
  ProblemList& problems_;
};

}  // namespace

Network Network::ideal() {
  return {.latency = 0,
          .bandwidth = std::numeric_limits<double>::infinity(),
          .overhead = 0,
          .packing = false};
}

int tree_height(double n) {
  int height = 0;
  while (std::ldexp(1.0, height) < n) ++height;
  return height;
}

double Network::reduction(double ranks) const {
  return latency.value_or(0) * tree_height(ranks);
}

Network read_network(const std::string& path) {
  if (path == "ideal") return Network::ideal();
  if (path == "measured") return {};
  std::ifstream in(path);
  if (!in)
    throw InputError({Problem{.file = path,
                              .message = "cannot be read: a network is a JSON file, \"ideal\" or "
                                         "\"measured\"",
                              .hint = "for example {\"latency\": \"2us\", \"bandwidth\": "
                                      "\"10GB/s\", \"overhead\": \"500ns\"}"}});
  constexpr std::size_t most = 1 << 20;  // [bytes]; /dev/zero has no end
  std::string text(most + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > most)
    throw InputError({Problem{.file = path, .message = "is larger than a file of a network is"}});
  ProblemList problems;
  const JsonDocument document(path, text, problems);
  Network network;
  if (document.root.valid()) network = Reader(document, problems).read();
  if (!problems.empty()) throw InputError(problems.errors(path));
  return network;
}

std::string short_time(double seconds) {
  if (seconds == 0) return "0";
  if (seconds < 1e-6) return fmt::format("{:.3g} ns", seconds * 1e9);
  if (seconds < 1e-3) return fmt::format("{:.3g} us", seconds * 1e6);
  if (seconds < 1) return fmt::format("{:.3g} ms", seconds * 1e3);
  return fmt::format("{:.3g} s", seconds);
}

std::string text_of(const Network& network) {
  if (!network.packing && network.latency == 0.0) return "ideal: messages take no time";
  const auto time = [](const std::optional<double>& value) {
    return value ? short_time(*value) : std::string("as measured");
  };
  const std::string bandwidth = !network.bandwidth ? "as measured"
                                : std::isinf(*network.bandwidth)
                                    ? "unlimited"
                                    : fmt::format("{:.3g} GB/s", *network.bandwidth * 1e-9);
  return fmt::format("latency {}, bandwidth {}, overhead {}", time(network.latency), bandwidth,
                     time(network.overhead));
}

}  // namespace lahar
