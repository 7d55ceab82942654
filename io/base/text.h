/// \file Text for people: quantities, and text from outside that is safe to show.
#pragma once

#include <string>
#include <string_view>

#include "physics/base/types.h"

namespace lahar {

std::string format_bytes(double bytes);  ///< 1.5 MiB
std::string format_count(Index n);       ///< 40,155

/// Text from input (names, titles, paths, words of a file) as a terminal, a log or a table may get
/// it: control characters become visible escapes (`\n`, `\x1b`, `\u009b`), and so do characters
/// that change the direction of text and bytes that are not UTF-8 (`\xff`). All other UTF-8 stays.
std::string printable(std::string_view text);
/// The same of text with several lines: line ends and tabs stay.
std::string printable_lines(std::string_view text);

/// A name of columns or maps as people read it: "pore pressure" of pore_pressure.
std::string readable(std::string_view name);

/// Columns that valid text of printable() takes: its characters.
std::size_t text_width(std::string_view text);

/// The longest part of `text` of at most `bytes` bytes that does not end inside of a character.
std::string_view cut_text(std::string_view text, std::size_t bytes);

/// printable() text for XML and HTML: & < > " are written as entities.
std::string xml_escaped(std::string_view text);

}  // namespace lahar
