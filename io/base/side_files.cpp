#include "io/base/side_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "io/base/atomic_file.h"
#include "io/base/text.h"

namespace lahar {

namespace {

/// A text that is read as a whole, such as a scenario [bytes].
constexpr std::size_t most_text = std::size_t{1} << 30;

}  // namespace

std::optional<std::string> read_text_file(const std::string& path, std::string& reason) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) {
    reason = "is a folder, not a file";
    return std::nullopt;
  }
  if (may_be_endless(status)) {
    reason = "is not a regular file";
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
  if (!error && size > most_text) {
    reason = fmt::format("has {}; at most {} are read", format_bytes(static_cast<double>(size)),
                         format_bytes(static_cast<double>(most_text)));
    return std::nullopt;
  }
  if (!error) text.resize(size);
  std::size_t have = 0, got;
  while ((got = std::fread(text.data() + have, 1, text.size() - have, in.get())) > 0) {
    have += got;
    if (have > most_text) {
      reason = fmt::format("has more than {}", format_bytes(static_cast<double>(most_text)));
      return std::nullopt;
    }
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

std::optional<SideFile> open_side_file(std::string name, const std::string& path,
                                       std::string& reason) {
  SideFile file{std::move(name), path, 0, ""};
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  const auto refuse = [&](std::string why) {
    reason = std::move(why);
    return std::nullopt;
  };
  if (!std::filesystem::exists(status)) return refuse("does not exist");
  if (std::filesystem::is_directory(status)) return refuse("is a folder, not a file");
  // It is read in pieces, and as often as needed.
  if (!std::filesystem::is_regular_file(status)) return refuse("is not a regular file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(path.c_str(), "rb"),
                                                           &std::fclose);
  if (!in) return refuse(std::strerror(errno));
  file.size = static_cast<Index>(std::filesystem::file_size(path, error));
  if (error) return refuse(error.message());
  if (file.size == 0) return refuse("is empty");
  return file;
}

std::size_t SideFile::read(Index offset, char* to, std::size_t n) const {
  if (offset >= size) return 0;
  if (!regular()) return text.copy(to, n, static_cast<std::size_t>(offset));
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(path.c_str(), "rb"),
                                                           &std::fclose);
  const auto fail = [&] { throw IoError(fmt::format("{}: {}", path, std::strerror(errno))); };
  if (!in || ::fseeko(in.get(), offset, SEEK_SET) != 0) fail();
  std::setbuf(in.get(), nullptr);  // pieces are large
  std::size_t have = 0, got;
  while (have < n && (got = std::fread(to + have, 1, n - have, in.get())) > 0) have += got;
  if (std::ferror(in.get())) fail();
  return have;
}

std::string SideFile::all() const {
  std::string out(static_cast<std::size_t>(size), '\0');
  out.resize(read(0, out.data(), out.size()));
  return out;
}

namespace {

// Bytes of a file that are in memory at a time.
constexpr std::size_t piece_size = std::size_t{1} << 18;

// Call `visit(begin, end)` for each line of a file that begins at or after `offset`, until it
// returns false. The file in pieces, a line as a whole.
void for_lines(const SideFile& file, Index offset, auto&& visit) {
  std::vector<char> piece(piece_size);
  std::size_t held = 0;
  while (true) {
    const std::size_t got = file.read(offset, piece.data() + held, piece.size() - held);
    offset += static_cast<Index>(got);
    held += got;
    const char *at = piece.data(), *end = at + held;
    const bool last = held < piece.size();
    while (at < end) {
      const char* stop = row_end(at, end);
      if (stop == end && !last) break;
      if (!visit(at, stop)) return;
      at = std::min(stop + 1, end);
    }
    if (last) return;
    held = static_cast<std::size_t>(end - at);
    std::memmove(piece.data(), at, held);
    if (held == piece.size()) piece.resize(2 * piece.size());
  }
}

}  // namespace

int SideFile::line_of_row(Index row) const {
  int line = 0, found = 0;
  for_lines(*this, 0, [&](const char* at, const char* end) {
    ++line;
    if (is_data(at, end) && row-- == 0) found = line;
    return found == 0;
  });
  return found;
}

Problem SideFile::at_line(int line, std::string message, std::string hint) const {
  Problem p;
  p.file = name;
  p.line = line;
  p.message = std::move(message);
  p.hint = std::move(hint);
  if (line == 0) return p;
  for_lines(*this, 0, [&](const char* at, const char* end) {
    if (--line > 0) return true;
    p.source.assign(at, std::find(at, end, '\r'));
    return false;
  });
  return p;
}

Index SideFile::line_start(Index offset) const {
  if (offset <= 0) return 0;
  if (offset >= size) return size;
  std::vector<char> piece(std::size_t{1} << 12);
  for (--offset; offset < size;) {
    const std::size_t got = read(offset, piece.data(), piece.size());
    if (got == 0) break;
    const char* stop = row_end(piece.data(), piece.data() + got);
    offset += stop - piece.data();
    if (stop < piece.data() + got) return offset + 1;
  }
  return size;
}

RowReader::RowReader(const SideFile& file, ProblemList& problems)
    : RowReader(file, problems, 0, file.size) {}

RowReader::RowReader(const SideFile& file, ProblemList& problems, Index begin, Index end)
    : file_(file), problems_(problems), filled_(begin), stop_(end) {}

namespace {

// "1-4, 7, 9-12, ...". The lines ascend; at most eight ranges are named.
std::string line_ranges(const std::vector<int>& lines) {
  constexpr int most = 8;
  std::string text;
  int ranges = 0;
  for (std::size_t i = 0; i < lines.size(); ++ranges) {
    if (ranges == most) return text + ", ...";
    std::size_t end = i + 1;
    while (end < lines.size() && lines[end] == lines[end - 1] + 1) ++end;
    text += fmt::format("{}{}", ranges > 0 ? ", " : "", lines[i]);
    if (end > i + 1) text += fmt::format("-{}", lines[end - 1]);
    i = end;
  }
  return text;
}

}  // namespace

RowReader::~RowReader() {
  if (mended())
    problems_.warning(
        {.file = file_.name,
         .message = fmt::format("{} is missing in {} row{}: 0 is taken (line{} {})", value_name_,
                                without_value_.size(), without_value_.size() == 1 ? "" : "s",
                                without_value_.size() == 1 ? "" : "s", line_ranges(without_value_)),
         .hint = "CB-Geo MPM sets no value there, and takes what its memory holds"});
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
  p.source.assign(row_, end);
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

const char* RowReader::whole_line() {
  const char* stop = next_ == end_ ? end_ : row_end(next_, end_);
  while (stop == end_ && filled_ < stop_) {
    const auto held = static_cast<std::size_t>(end_ - next_);
    if (held > 0) std::memmove(piece_.data(), next_, held);
    if (piece_.size() < 2 * held + 1) piece_.resize(std::max(piece_size, 2 * piece_.size()));
    const auto room = std::min(static_cast<Index>(piece_.size() - held), stop_ - filled_);
    const auto got = file_.read(filled_, piece_.data() + held, static_cast<std::size_t>(room));
    filled_ += static_cast<Index>(got);
    if (got == 0) stop_ = filled_;  // the file has become shorter
    next_ = piece_.data();
    end_ = next_ + held + got;
    stop = row_end(next_ + held, end_);
  }
  return stop;
}

bool RowReader::next() {
  while (true) {
    row_end_ = whole_line();
    if (next_ == end_) {
      row_ = at_ = column_ = row_end_ = next_;
      return false;
    }
    row_ = at_ = next_;
    next_ = row_end_ == end_ ? end_ : row_end_ + 1;
    ++line_;
    if (is_data(at_, row_end_)) {
      column_ = at_;
      return true;
    }
  }
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
  complain(fmt::format("{} must be a finite number, found '{}'", what, word));
  return false;
}

bool RowReader::value(double& value, std::string_view what) {
  while (at_ < row_end_ && blank(*at_)) ++at_;
  if (!file_.as_cbgeo || at_ < row_end_) return real(value, what);
  value = 0;
  without_value_.push_back(line_);
  value_name_ = what;
  return true;
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
  complain(fmt::format("{} must be {}, found '{}'", what, range, word));
  return false;
}

bool RowReader::row_ended() {
  while (at_ < row_end_ && blank(*at_)) ++at_;
  return at_ == row_end_;
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
    complain(fmt::format("unexpected '{}' at the end of the row", word));
  return false;
}

}  // namespace lahar
