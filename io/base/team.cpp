#include "io/base/team.h"

#include <exception>
#include <new>
#include <string>
#include <string_view>

namespace lahar {

namespace {

/// What a message between members is made of: numbers and texts, one after the other.
class Letter {
 public:
  Letter() = default;
  explicit Letter(std::vector<char> text) : text_(std::move(text)) {}
  const std::vector<char>& content() const { return text_; }
  bool at_end() const { return at_ == text_.size(); }

  void put(Index value) {
    const auto* raw = reinterpret_cast<const char*>(&value);
    text_.insert(text_.end(), raw, raw + sizeof value);
  }
  void put(std::string_view text) {
    put(static_cast<Index>(text.size()));
    text_.insert(text_.end(), text.begin(), text.end());
  }
  Index number() {
    Index value = 0;
    std::copy_n(text_.data() + at_, sizeof value, reinterpret_cast<char*>(&value));
    at_ += sizeof value;
    return value;
  }
  std::string text() {
    const auto n = static_cast<std::size_t>(number());
    std::string out(text_.data() + at_, n);
    at_ += n;
    return out;
  }

 private:
  std::vector<char> text_;
  std::size_t at_ = 0;
};

void put(Letter& letter, const Problem& p) {
  for (const int number : {p.line, p.column}) letter.put(Index{number});
  for (const auto* text : {&p.file, &p.where, &p.message, &p.hint, &p.source}) letter.put(*text);
}

Problem take_problem(Letter& letter) {
  Problem p;
  for (int* number : {&p.line, &p.column}) *number = static_cast<int>(letter.number());
  for (auto* text : {&p.file, &p.where, &p.message, &p.hint, &p.source}) *text = letter.text();
  return p;
}

void put(Letter& letter, const std::vector<Problem>& problems) {
  letter.put(static_cast<Index>(problems.size()));
  for (const Problem& p : problems) put(letter, p);
}

std::vector<Problem> take_problems(Letter& letter) {
  std::vector<Problem> problems(static_cast<std::size_t>(letter.number()));
  for (Problem& p : problems) p = take_problem(letter);
  return problems;
}

void put(Letter& letter, const FirstProblems& found) {
  put(letter, found.kept);
  letter.put(static_cast<Index>(found.dropped));
}

FirstProblems take_first_problems(Letter& letter) {
  FirstProblems found{.kept = take_problems(letter)};
  found.dropped = static_cast<std::size_t>(letter.number());
  return found;
}

// Exceptions by kind; the rest becomes a std::runtime_error.
enum Kind : Index { input, file, simulation, ranks, memory, other };

Letter describe(std::exception_ptr error) {
  Letter letter;
  const auto say = [&](Kind kind, std::string_view what) {
    letter.put(Index{kind});
    letter.put(what);
  };
  try {
    std::rethrow_exception(error);
  } catch (const InputError& e) {
    letter.put(Index{input});
    put(letter, e.problems());
  } catch (const IoError& e) {
    say(file, e.what());
  } catch (const SimulationError& e) {
    say(simulation, e.what());
  } catch (const RankError& e) {
    say(ranks, e.what());
  } catch (const std::bad_alloc&) {
    say(memory, "");
  } catch (const std::exception& e) {
    say(other, e.what());
  }
  return letter;
}

[[noreturn]] void raise(Letter letter) {
  const Index kind = letter.number();
  if (kind == input) throw InputError(take_problems(letter));
  const std::string what = letter.text();
  switch (kind) {
    case file:
      throw IoError(what);
    case simulation:
      throw SimulationError(what);
    case ranks:
      throw RankError(what);
    case memory:
      throw std::bad_alloc();
    default:
      throw std::runtime_error(what);
  }
}

}  // namespace

void all_or_none(const Team& team, const std::function<void()>& part) {
  if (team.alone()) return part();
  std::exception_ptr own;
  Letter letter;
  try {
    part();
  } catch (...) {
    own = std::current_exception();
    letter = describe(own);
  }
  for (const auto& said : team.gather(letter.content()))
    if (!said.empty()) raise(Letter(said));
}

void by_the_first(const Team& team, ProblemList& problems,
                  const std::function<void(ProblemList&)>& look) {
  if (team.alone()) return look(problems);
  Letter letter;
  all_or_none(team, [&] {
    if (team.index() != 0) return;
    ProblemList found;
    look(found);
    put(letter, found.found_errors());
    put(letter, found.found_warnings());
  });
  Letter said(team.gather(letter.content()).front());
  FirstProblems errors = take_first_problems(said), warnings = take_first_problems(said);
  problems.add(std::move(errors), std::move(warnings));
}

}  // namespace lahar
