/// \file The words and numbers of a Gmsh file, as text or binary.
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "io/base/binary_reader.h"

namespace lahar {

class GmshSource {
 public:
  explicit GmshSource(const SideFile& file) : file_(file), in_(file) {}

  bool binary = false;  ///< whether numbers are as in memory

  /// The rest of the line, without its end; false at the end of the file.
  bool line(std::string& to) {
    to.clear();
    char c;
    bool any = false;
    while (in_.get(c)) {
      any = true;
      if (c == '\n') break;
      to += c;
    }
    if (any) last_line_ = line_++;
    while (!to.empty() && (to.back() == '\r' || to.back() == ' ')) to.pop_back();
    return any;
  }
  /// The next word of text. Fails at the end of the file.
  std::string_view word(std::string_view what) {
    constexpr std::size_t longest = 64;
    word_.clear();
    char c;
    while (in_.get(c)) {
      if (c == '\n') ++line_;
      const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
      if (blank && word_.empty()) continue;
      if (blank) return word_;
      last_line_ = line_;
      word_ += c;
      if (word_.size() > longest) fail(std::string(what) + " must be a number");
    }
    if (word_.empty()) fail("the file ends before " + std::string(what) + ": it is cut short");
    return word_;
  }
  /// The next number, of this type where the file is binary.
  template <class T>
  T number(std::string_view what) {
    T value{};
    if (binary) {
      if (!in_.get(value)) fail("the file ends before " + std::string(what) + ": it is cut short");
      return value;
    }
    const std::string_view text = word(what);
    const char *begin = text.data(), *end = begin + text.size();
    const auto [rest, error] = std::from_chars(begin + (text[0] == '+'), end, value);
    if (error != std::errc{} || rest != end)
      fail(std::string(what) + " must be a number, found '" + word_ + "'");
    return value;
  }
  /// A finite number.
  double real(std::string_view what) {
    const auto value = number<double>(what);
    if (!std::isfinite(value)) fail(std::string(what) + " must be a finite number");
    return value;
  }

  /// Throws what is wrong, with the line read last, or the byte.
  [[noreturn]] void fail(std::string message, std::string hint = "") const {
    Problem problem;
    if (binary) {
      message = "at byte " + std::to_string(in_.offset()) + ": " + message;
      problem.file = file_.name;
    } else {
      problem = file_.at_line(last_line_, "");
    }
    problem.message = std::move(message);
    problem.hint = std::move(hint);
    throw InputError({problem});
  }

  const SideFile& file() const { return file_; }
  Index left() const { return file_.size - in_.offset(); }  ///< [bytes]

 private:
  const SideFile& file_;
  BinaryReader in_;
  std::string word_;
  int line_ = 1;       ///< of what is read next
  int last_line_ = 1;  ///< of the last line or word
};

}  // namespace lahar
