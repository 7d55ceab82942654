/// \file The decisions that make a random case: named numbers, of which 0 is the simplest.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lahar::test {

/// A case is a function of its choices. Each has a name, so that another value of one leaves the
/// others as they are, and what is not in a list is 0: that is how cases that fail are simplified.
class Choices {
 public:
  using Values = std::map<std::string, int>;

  /// Random, but for those that are given.
  explicit Choices(std::uint64_t seed, Values given = {})
      : seed_(seed), random_(true), given_(std::move(given)) {}
  explicit Choices(Values values) : given_(std::move(values)) {}

  /// One of 0 to n - 1. Asked again, the same.
  int pick(const std::string& name, int n);
  /// True, which is 1, in so many of a hundred cases.
  bool chance(const std::string& name, int percent);
  /// One of the options, of which the first is the simplest.
  template <class T>
  T of(const std::string& name, std::initializer_list<T> options) {
    return options.begin()[pick(name, static_cast<int>(options.size()))];
  }
  std::string of(const std::string& name, std::initializer_list<const char*> options) {
    return options.begin()[pick(name, static_cast<int>(options.size()))];
  }
  /// The simplest number, or one of 16 in [low, high], with four digits.
  double number(const std::string& name, double simplest, double low, double high);

  /// All that were asked for and are not 0.
  const Values& values() const { return values_; }

 private:
  std::uint64_t draw(const std::string& name) const;
  int note(const std::string& name, int value);

  std::uint64_t seed_ = 0;
  bool random_ = false;
  Values given_, values_;
};

/// Make choices simpler, one by one, as long as `fails` holds for what is left, at most `most`
/// tries. The order of tries depends on nothing but the choices and what `fails` returned.
Choices::Values shrink(Choices::Values values, const std::function<bool(Choices::Values&)>& fails,
                       int most);

/// "scheme=2 steps=17 ..."
std::string text_of(const Choices::Values& values);
/// The reverse. Throws std::invalid_argument.
Choices::Values values_in(const std::string& text);

}  // namespace lahar::test
