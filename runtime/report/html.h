/// \file Pieces of the page.
#pragma once

#include <string>
#include <vector>

#include "io/base/text.h"
#include "runtime/picture/chart.h"

namespace lahar {

/// Colours of the page, which follow light and dark.
inline constexpr Ink page_ink{.text = "var(--ink)",
                              .soft = "var(--soft)",
                              .grid = "var(--chart-grid)",
                              .ground = "var(--ground)"};

/// Of the k-th line of a chart.
std::string line_colour(std::size_t k);

/// A part of the page with a heading; "" without content.
std::string card(const std::string& heading, const std::string& content);

/// Charts beside each other, those without points left out; "" where none is left.
std::string charts(const std::vector<Chart>& list);

/// Cells are HTML. Those of the first column are text; in a table of two columns all are.
std::string html_table(const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows);

/// Text that is folded at first.
std::string folded(const std::string& heading, const std::string& content);

}  // namespace lahar
