#include "io/base/problems.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <tuple>
#include <utility>

#include "io/base/text.h"

namespace lahar {

void FirstProblems::add(Problem problem) {
  if (kept.size() < cap)
    kept.push_back(std::move(problem));
  else
    ++dropped;
}

void ProblemList::add(FirstProblems errors, FirstProblems warnings) {
  const auto join = [](FirstProblems& to, FirstProblems& from) {
    for (Problem& problem : from.kept) to.add(std::move(problem));
    to.dropped += from.dropped;
  };
  join(errors_, errors);
  join(warnings_, warnings);
}

namespace {

void tell_dropped(std::vector<Problem>& problems, std::size_t dropped, const std::string& file,
                  std::string_view kind) {
  if (dropped == 0) return;
  problems.push_back({.file = file, .message = fmt::format("and {} more {}", dropped, kind)});
}

}  // namespace

std::vector<Problem> ProblemList::errors(const std::string& file) const {
  auto sorted = errors_.kept;
  const auto rank = [&](const Problem& p) {
    const int group = p.file.empty() ? 0 : p.file == file ? 1 : 2;
    return group == 2 ? std::tuple(2, 0, 0) : std::tuple(group, p.line, p.column);
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Problem& a, const Problem& b) { return rank(a) < rank(b); });
  tell_dropped(sorted, errors_.dropped, file, "problems");
  return sorted;
}

std::vector<Problem> ProblemList::take_warnings(const std::string& file) {
  FirstProblems taken = std::exchange(warnings_, {});
  tell_dropped(taken.kept, taken.dropped, file, "warnings");
  return std::move(taken.kept);
}

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Edit distance with swaps of neighbours (optimal string alignment).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string wanted = lower(name);
  std::string best;
  std::size_t least = std::max<std::size_t>(1, name.size() / 3) + 1;
  for (const auto& candidate : candidates) {
    // Each character more is an edit: no table for names that are far too long.
    if (std::max(name.size(), candidate.size()) - std::min(name.size(), candidate.size()) >= least)
      continue;
    const std::size_t d = distance(wanted, lower(candidate));
    if (d < least && d < candidate.size()) {
      least = d;
      best = candidate;
    }
  }
  return best;
}

std::string join(const std::vector<std::string>& words, std::string_view separator) {
  return fmt::format("{}", fmt::join(words, separator));
}

std::string suggest(std::string_view name, const std::vector<std::string>& candidates,
                    std::string_view what) {
  const std::string near = nearest(name, candidates);
  if (!near.empty()) return fmt::format("did you mean '{}'?", near);
  return candidates.empty() ? "" : fmt::format("{}: {}", what, join(candidates));
}

namespace {

/// A line of input and, where a column [bytes, 1-based] is known, a caret below it.
std::string quoted_source(std::string_view source, int column, const char* green, const char* off) {
  // A longer line (a mesh on one line, say) would bury the message.
  constexpr std::size_t longest = 160;
  const std::size_t at =
      std::min(column > 0 ? static_cast<std::size_t>(column) - 1 : 0, source.size());
  const std::size_t skip = at > longest / 2 ? cut_text(source, at - longest / 2).size() : 0;
  const std::string_view shown = cut_text(source.substr(skip), longest);
  std::string out = "  ";
  // Tabs stay tabs, so that the caret lands below its character.
  const auto add = [](std::string& to, std::string_view text, auto&& convert) {
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t tab = std::min(text.find('\t', begin), text.size());
      to += convert(printable(text.substr(begin, tab - begin)));
      if (tab < text.size()) to += '\t';
      begin = tab + 1;
    }
  };
  const auto same = [](std::string text) { return text; };
  add(out, shown.substr(0, at - skip), same);
  add(out, shown.substr(std::min(at - skip, shown.size())), same);
  out += '\n';
  if (column <= 0) return out;
  out += "  ";
  add(out, source.substr(skip, at - skip),
      [](const std::string& text) { return std::string(text_width(text), ' '); });
  return out + fmt::format("{}^{}\n", green, off);
}

/// What people read of a message, which may quote a word of any length.
std::string shown(std::string_view text) {
  constexpr std::size_t longest = 4000;  // [bytes]
  if (text.size() <= longest) return printable(text);
  return printable(cut_text(text, longest)) + " ...";
}

}  // namespace

std::string format_problems(const std::vector<Problem>& problems, const char* severity,
                            bool colour) {
  const char* bold = colour ? "\033[1m" : "";
  const char* red =
      colour ? (std::string_view(severity) == "error" ? "\033[1;31m" : "\033[1;35m") : "";
  const char* green = colour ? "\033[1;32m" : "";
  const char* off = colour ? "\033[0m" : "";
  std::string out;
  for (const Problem& p : problems) {
    out += fmt::format("{}{}", bold, p.file.empty() ? "command line" : printable(p.file));
    if (p.line > 0) out += fmt::format(":{}", p.line);
    if (p.line > 0 && p.column > 0) out += fmt::format(":{}", p.column);
    out += fmt::format(": {}{}:{} {}", red, severity, off, shown(p.message));
    if (!p.where.empty()) out += fmt::format(" [{}]", printable(p.where));
    out += '\n';
    if (!p.source.empty()) out += quoted_source(p.source, p.column, green, off);
    if (!p.hint.empty()) out += fmt::format("  hint: {}\n", shown(p.hint));
  }
  return out;
}

}  // namespace lahar
