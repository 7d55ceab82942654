#include "io/side_files.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace lahar {

std::optional<std::string> read_text_file(const std::string& path, std::string& reason) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    reason = "is a folder, not a file";
    return std::nullopt;
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(path.c_str(), "rb"),
                                                           &std::fclose);
  if (!in) {
    reason = errno == ENOENT ? "does not exist" : std::strerror(errno);
    return std::nullopt;
  }
  std::string text;
  const auto size = std::filesystem::file_size(path, error);
  if (!error) text.resize(size);
  std::size_t have = 0, got;
  while ((got = std::fread(text.data() + have, 1, text.size() - have, in.get())) > 0) {
    have += got;
    if (have == text.size()) text.resize(have + 4096);  // a pipe, or a file that grows
  }
  text.resize(have);
  if (std::ferror(in.get())) {
    reason = std::strerror(errno);
    return std::nullopt;
  }
  if (text.empty()) {
    reason = "is empty";
    return std::nullopt;
  }
  return text;
}

namespace {

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

// Text for a message: control characters would garble it.
std::string printable(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f) c = '?';
  return out;
}

// The row that begins at `begin`: its end, and whether it holds data.
const char* row_end(const char* begin, const char* end) {
  const auto* newline =
      static_cast<const char*>(std::memchr(begin, '\n', static_cast<std::size_t>(end - begin)));
  return newline ? newline : end;
}

bool is_data(const char*& at, const char* end) {
  while (at < end && blank(*at)) ++at;
  return at < end && *at != '#' && *at != '!';
}

}  // namespace

int SideFile::line_of_row(Index row) const {
  const char* end = text.data() + text.size();
  int line = 1;
  for (const char* at = text.data(); at < end; ++line) {
    const char* stop = row_end(at, end);
    const char* first = at;
    if (is_data(first, stop) && row-- == 0) return line;
    at = stop + 1;
  }
  return 0;
}

Problem SideFile::at_line(int line, std::string message, std::string hint) const {
  Problem p;
  p.file = name;
  p.line = line;
  p.message = std::move(message);
  p.hint = std::move(hint);
  std::size_t begin = 0;
  for (int i = 1; i < line; ++i) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return p;
    ++begin;
  }
  if (line > 0) p.source = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
  return p;
}

RowReader::RowReader(const SideFile& file, ProblemList& problems)
    : file_(file),
      problems_(problems),
      at_(file.text.data()),
      row_(at_),
      row_end_(at_),
      next_(at_),
      end_(at_ + file.text.size()),
      column_(at_) {}

RowReader::~RowReader() {
  if (failures_ > cap) {
    Problem p;
    p.file = file_.name;
    p.message = fmt::format("and {} more problems in this file", failures_ - cap);
    problems_.error(std::move(p));
  }
}

void RowReader::complain(std::string message, std::string hint) {
  if (++failures_ > cap) return;
  Problem p;
  p.file = file_.name;
  p.line = line_;
  p.column = static_cast<int>(column_ - row_) + 1;
  p.message = std::move(message);
  p.hint = std::move(hint);
  const char* end = row_end_;
  while (end > row_ && blank(end[-1])) --end;
  p.source = printable({row_, static_cast<std::size_t>(end - row_)});
  problems_.error(std::move(p));
}

void RowReader::complain_file(std::string message, std::string hint) {
  if (++failures_ > cap) return;
  Problem p;
  p.file = file_.name;
  p.message = std::move(message);
  p.hint = std::move(hint);
  problems_.error(std::move(p));
}

bool RowReader::next() {
  while (next_ < end_) {
    row_ = at_ = next_;
    row_end_ = row_end(row_, end_);
    next_ = row_end_ + 1;
    ++line_;
    if (is_data(at_, row_end_)) {
      column_ = at_;
      return true;
    }
  }
  return false;
}

bool RowReader::token(std::string_view what, std::string_view& out) {
  while (at_ < row_end_ && blank(*at_)) ++at_;
  column_ = at_;
  if (at_ == row_end_) {
    complain(fmt::format("{} is missing", what));
    return false;
  }
  const char* begin = at_;
  while (at_ < row_end_ && !blank(*at_)) ++at_;
  out = {begin, static_cast<std::size_t>(at_ - begin)};
  return true;
}

namespace {

// The start of a token that std::from_chars understands: it refuses a plus sign.
const char* after_plus(const char* at, const char* end) {
  return end - at > 1 && *at == '+' && at[1] != '-' && at[1] != '+' ? at + 1 : at;
}

}  // namespace

bool RowReader::real(double& value, std::string_view what) {
  while (at_ < row_end_ && blank(*at_)) ++at_;
  const char* begin = after_plus(at_, row_end_);
  const auto [rest, ec] = std::from_chars(begin, row_end_, value);
  if (ec == std::errc{} && (rest == row_end_ || blank(*rest)) && std::isfinite(value)) {
    column_ = at_;
    at_ = rest;
    return true;
  }
  std::string_view word;
  if (!token(what, word)) return false;
  complain(fmt::format("{} must be a finite number, found '{}'", what, printable(word)));
  return false;
}

bool RowReader::integer(Index& value, std::string_view what, Index low, Index high) {
  while (at_ < row_end_ && blank(*at_)) ++at_;
  const char* begin = after_plus(at_, row_end_);
  const auto [rest, ec] = std::from_chars(begin, row_end_, value);
  if (ec == std::errc{} && (rest == row_end_ || blank(*rest)) && value >= low && value <= high) {
    column_ = at_;
    at_ = rest;
    return true;
  }
  std::string_view word;
  if (!token(what, word)) return false;
  const std::string range = high == std::numeric_limits<Index>::max()
                                ? fmt::format("an integer of at least {}", low)
                                : fmt::format("an integer from {} to {}", low, high);
  complain(fmt::format("{} must be {}, found '{}'", what, range, printable(word)));
  return false;
}

bool RowReader::end_of_row(int optional) {
  for (; optional >= 0; --optional) {
    while (at_ < row_end_ && blank(*at_)) ++at_;
    if (at_ == row_end_) return true;
    double unused;
    const bool comment = *at_ == '#' || *at_ == '!';
    if (optional > 0 && !comment && !real(unused, "the third coordinate")) return false;
  }
  std::string_view word;
  if (!token("", word)) return false;
  if (word[0] == '#' || word[0] == '!')
    complain("a comment must have a line of its own", "the reference skips the whole line");
  else
    complain(fmt::format("unexpected '{}' at the end of the row", printable(word)));
  return false;
}

}  // namespace lahar
