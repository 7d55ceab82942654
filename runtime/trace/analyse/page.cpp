#include "runtime/trace/analyse/page.h"

#include <stdexcept>
#include <string_view>

#include "lahar_trace_page.h"
#include "runtime/trace/analyse/page_data.h"

namespace lahar {

namespace {

/// JSON within a <script>: nothing in it may look like HTML.
std::string within_script(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

}  // namespace

std::string page_of(const TraceLog& log, const TraceReport& report, std::size_t most_tasks) {
  const auto part = [&](std::string_view name) -> std::string {
    if (name == "style") return std::string(embedded::page_style);
    if (name == "script") return std::string(embedded::page_script);
    if (name == "chart style") return std::string(embedded::chart_style);
    if (name == "chart script") return std::string(embedded::chart_script);
    if (name == "chart licence") return std::string(embedded::chart_licence);
    if (name == "report") return within_script(json_of(log, report));
    if (name == "timeline") return within_script(timeline_of(log, report, most_tasks));
    throw std::logic_error("page.html asks for '" + std::string(name) + "'");
  };
  std::string page;
  std::string_view rest = embedded::page_template;
  for (;;) {
    const std::size_t mark = rest.find("{{");
    page += rest.substr(0, mark);
    if (mark == std::string_view::npos) return page;
    const std::size_t end = rest.find("}}", mark);
    page += part(rest.substr(mark + 2, end - mark - 2));
    rest.remove_prefix(end + 2);
  }
}

}  // namespace lahar
