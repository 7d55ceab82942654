#include "tests/properties/choices.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <stdexcept>

namespace lahar::test {

namespace {

/// SplitMix64 (Steele, Lea and Flood 2014).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

double with_four_digits(double value) {
  return std::stod(fmt::format("{:.4g}", value));
}

}  // namespace

std::uint64_t Choices::draw(const std::string& name) const {
  std::uint64_t state = mix(seed_);
  for (const char c : name) state = mix(state ^ static_cast<unsigned char>(c));
  return state;
}

int Choices::note(const std::string& name, int value) {
  if (value != 0) values_[name] = value;
  return value;
}

int Choices::pick(const std::string& name, int n) {
  const auto found = given_.find(name);
  if (random_ && found == given_.end())
    return note(name, static_cast<int>(draw(name) % static_cast<std::uint64_t>(n)));
  return note(name, found == given_.end() ? 0 : std::clamp(found->second, 0, n - 1));
}

bool Choices::chance(const std::string& name, int percent) {
  if (random_ && !given_.contains(name))
    return note(name, draw(name) % 100 < static_cast<std::uint64_t>(percent)) != 0;
  return pick(name, 2) != 0;
}

double Choices::number(const std::string& name, double simplest, double low, double high) {
  constexpr int steps = 16;
  const int k = pick(name, steps + 1);
  return k == 0 ? simplest : with_four_digits(low + (high - low) * (k - 1) / (steps - 1));
}

Choices::Values shrink(Choices::Values values, const std::function<bool(Choices::Values&)>& fails,
                       int most) {
  std::set<Choices::Values> tried;
  const auto accept = [&](Choices::Values simpler) {
    if (most <= 0 || !tried.insert(simpler).second) return false;
    --most;
    if (!fails(simpler)) return false;  // else it has what this case asked for
    const bool changed = simpler != values;
    values = std::move(simpler);
    return changed;
  };
  for (bool again = true; again && most > 0;) {
    again = false;
    const Choices::Values before = values;
    for (const auto& [name, value] : before) {
      Choices::Values without = values;
      if (without.erase(name) == 1 && accept(without)) {
        again = true;
        continue;
      }
      for (const int smaller : {value / 2, value - 1}) {
        Choices::Values lower = values;
        const auto at = lower.find(name);
        if (at == lower.end() || smaller < 1 || smaller >= at->second) continue;
        at->second = smaller;
        if (!accept(lower)) continue;
        again = true;
        break;
      }
    }
  }
  return values;
}

std::string text_of(const Choices::Values& values) {
  std::string text;
  for (const auto& [name, value] : values)
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
  return text;
}

Choices::Values values_in(const std::string& text) {
  Choices::Values values;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) throw std::invalid_argument("not name=value: " + word);
    values[word.substr(0, equals)] = std::stoi(word.substr(equals + 1));
  }
  return values;
}

}  // namespace lahar::test
