/// \file The processes that read a scenario together, each its share of the particles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/base/problems.h"
#include "physics/base/types.h"

namespace lahar {

/// A group of readers, numbered from 0; this base class is one that is alone. Whoever has several
/// processes (or threads) derives from it. Every function but index() and size() is collective: all
/// members call it, in the same order, and none returns before all have called.
class Team {
 public:
  using Bytes = std::vector<std::byte>;

  virtual ~Team() = default;
  virtual int index() const { return 0; }
  virtual int size() const { return 1; }
  bool alone() const { return size() == 1; }

  /// What each member gives; all get everything.
  virtual std::vector<Bytes> gather_bytes(Bytes own) const {
    std::vector<Bytes> all;
    all.push_back(std::move(own));
    return all;
  }
  /// to[i] goes to member i; returns what each member had for this one.
  virtual std::vector<Bytes> exchange_bytes(std::vector<Bytes> to) const { return to; }

  /// The values of each member.
  template <class T>
  std::vector<std::vector<T>> gather(const std::vector<T>& own) const {
    return values<T>(gather_bytes(bytes(own)));
  }
  template <class T>
  std::vector<std::vector<T>> exchange(std::vector<std::vector<T>> to) const {
    if (alone()) return to;
    std::vector<Bytes> parts;
    for (auto& part : to) parts.push_back(bytes(std::exchange(part, {})));
    return values<T>(exchange_bytes(std::move(parts)));
  }

  /// One number of each member.
  std::vector<Index> each(Index own) const {
    std::vector<Index> all;
    for (const auto& one : gather(std::vector<Index>{own})) all.push_back(one.front());
    return all;
  }
  /// The largest of all members, element by element.
  std::vector<double> most(std::vector<double> own) const {
    for (const auto& member : gather(own))
      for (std::size_t k = 0; k < own.size(); ++k) own[k] = std::max(own[k], member[k]);
    return own;
  }
  Index sum(Index own) const {
    const auto all = each(own);
    return std::accumulate(all.begin(), all.end(), Index{0});
  }
  double sum(double own) const {
    double all = 0;
    for (const auto& one : gather(std::vector<double>{own})) all += one.front();
    return all;
  }
  Index max(Index own) const {
    const auto all = each(own);
    return *std::max_element(all.begin(), all.end());
  }
  bool any(bool own) const { return max(own) != 0; }
  /// Where this member's part of [0, n) begins; part(n, size()) would be n.
  Index part(Index n, int member) const {
    return n / size() * member + n % size() * member / size();
  }
  /// Whose part i of [0, n) is.
  int member(Index i, Index n) const {
    auto member = static_cast<int>(i / std::max<Index>(n / size() + 1, 1));
    while (part(n, member + 1) <= i) ++member;
    return member;
  }

 private:
  template <class T>
  static Bytes bytes(const std::vector<T>& from) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto raw = std::as_bytes(std::span(from));
    return {raw.begin(), raw.end()};
  }
  template <class T>
  static std::vector<std::vector<T>> values(const std::vector<Bytes>& parts) {
    std::vector<std::vector<T>> out;
    for (const Bytes& part : parts) {
      auto& to = out.emplace_back(part.size() / sizeof(T));
      std::copy(part.begin(), part.end(), reinterpret_cast<std::byte*>(to.data()));
    }
    return out;
  }
};

/// Lists of all members, one after the other.
template <class T>
std::vector<T> joined(std::vector<std::vector<T>> parts) {
  std::vector<T> all;
  for (std::vector<T>& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    part = {};
  }
  return all;
}

/// Let every member do its part; where one throws, all throw what the first of these threw.
void all_or_none(const Team& team, const std::function<void()>& part);

/// What another member knows: `answer(question)` of the member `holder(question)` for each of this
/// one's, some at a time. Collective.
template <class Answer, class Question>
std::vector<Answer> ask(const Team& team, const std::vector<Question>& questions, auto&& holder,
                        auto&& answer) {
  constexpr std::size_t at_a_time = std::size_t{1} << 15;
  const auto members = static_cast<std::size_t>(team.size());
  std::vector<Answer> answers;
  answers.reserve(questions.size());
  std::vector<std::size_t> asked;
  while (team.any(answers.size() < questions.size())) {
    const std::size_t end = std::min(questions.size(), answers.size() + at_a_time);
    std::vector<std::vector<Question>> to(members);
    asked.clear();
    for (std::size_t i = answers.size(); i < end; ++i) {
      asked.push_back(static_cast<std::size_t>(holder(questions[i])));
      to[asked.back()].push_back(questions[i]);
    }
    std::vector<std::vector<Answer>> replies(members);
    const auto from = team.exchange(std::move(to));
    all_or_none(team, [&] {
      for (std::size_t m = 0; m < members; ++m)
        for (const Question& question : from[m]) replies[m].push_back(answer(question));
    });
    replies = team.exchange(std::move(replies));
    std::vector<std::size_t> next(members, 0);
    for (const std::size_t m : asked) answers.push_back(replies[m][next[m]++]);
  }
  return answers;
}

/// A list of which members have pieces, one after the other, in equal pieces (Team::part()).
/// Collective.
template <class T>
std::vector<T> spread_evenly(std::vector<T> own, const Team& team) {
  if (team.alone()) return own;
  Index total = 0, first = 0;
  const std::vector<Index> sizes = team.each(static_cast<Index>(own.size()));
  for (int m = 0; m < team.size(); ++m) {
    if (m == team.index()) first = total;
    total += sizes[static_cast<std::size_t>(m)];
  }
  std::vector<std::vector<T>> to(static_cast<std::size_t>(team.size()));
  for (const T& value : own)
    to[static_cast<std::size_t>(team.member(first++, total))].push_back(value);
  return joined(team.exchange(std::move(to)));
}

/// Let the first member alone look for problems; all members then have them. For what is slow or
/// needs everything at once, once it is clear that something is wrong.
void by_the_first(const Team& team, ProblemList& problems,
                  const std::function<void(ProblemList&)>& look);

}  // namespace lahar
