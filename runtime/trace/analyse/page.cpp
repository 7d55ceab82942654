#include "runtime/trace/analyse/page.h"

#include <sstream>
#include <stdexcept>
#include <string_view>

#include "io/base/text.h"
#include "lahar_trace_page.h"
#include "runtime/terminal/html_page.h"
#include "runtime/trace/analyse/page_data.h"

namespace lahar {

namespace {

/// What the page says without scripts.
std::string plain_text(const TraceLog& log, const TraceReport& report) {
  std::istringstream lines(text_of(log, report));
  std::string html;
  for (std::string line; std::getline(lines, line);) html += xml_escaped(line) + '\n';
  return html;
}

}  // namespace

std::string page_of(const TraceLog& log, const TraceReport& report, std::size_t most_tasks) {
  const auto part = [&](std::string_view name) -> std::string {
    if (name == "base style") return std::string(embedded::base_style);
    if (name == "style") return std::string(embedded::page_style);
    if (name == "script") return std::string(embedded::page_script);
    if (name == "chart style") return std::string(embedded::chart_style);
    if (name == "chart script") return std::string(embedded::chart_script);
    if (name == "chart licence") return std::string(embedded::chart_licence);
    if (name == "text") return plain_text(log, report);
    if (name == "report") return within_script(json_of(log, report));
    if (name == "timeline") return within_script(timeline_of(log, report, most_tasks));
    throw std::logic_error("page.html asks for '" + std::string(name) + "'");
  };
  return fill_page(embedded::page_template, part);
}

}  // namespace lahar
