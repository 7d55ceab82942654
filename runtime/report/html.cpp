#include "runtime/report/html.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "runtime/picture/svg.h"

namespace lahar {

namespace {

constexpr double chart_width = 620, chart_height = 270;

/// Text that is not UTF-8 (names of folders may be anything) is shown with replacement characters.
std::string text_of(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string chart_figure(const Chart& chart) {
  Svg svg(chart_width, chart_height, "none");
  const ChartScale s = draw_chart(svg, chart, chart_width, chart_height, page_ink);
  using nlohmann::json;
  json names = json::array();
  std::string legend;
  for (const ChartLine& line : chart.lines) {
    names.push_back({{"name", line.name}, {"colour", line.colour}});
    legend += fmt::format("<li><i style=\"background:{}\"></i>{}</li>", line.colour,
                          xml_escaped(line.name));
  }
  legend = chart.lines.size() > 1 ? "<ul class=\"legend\">" + legend + "</ul>" : "";
  const json scale{{"image", chart_width},     {"left", s.left},        {"top", s.top},
                   {"width", s.width},         {"height", s.height},    {"x", {s.x_low, s.x_high}},
                   {"y", {s.y_low, s.y_high}}, {"xName", chart.x_name}, {"xUnit", s.x_unit},
                   {"yUnit", s.y_unit}};
  return fmt::format(
      "<figure class=\"chart\" data-scale=\"{}\" data-names=\"{}\"><figcaption>{}{}</figcaption>\n"
      "{}</figure>\n",
      xml_escaped(text_of(scale)), xml_escaped(text_of(names)), xml_escaped(chart.title), legend,
      svg.finish());
}

}  // namespace

std::string line_colour(std::size_t k) {
  constexpr std::size_t colours = 8;
  return fmt::format("var(--s{})", k % colours);
}

std::string card(const std::string& heading, const std::string& content) {
  if (content.empty()) return "";
  return fmt::format("<section class=\"card\">\n<h2>{}</h2>\n{}</section>\n", heading, content);
}

std::string charts(const std::vector<Chart>& list) {
  std::string figures;
  for (const Chart& chart : list)
    if (has_points(chart)) figures += chart_figure(chart);
  return figures.empty() ? "" : "<div class=\"grid\">\n" + figures + "</div>\n";
}

std::string html_table(const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows) {
  const bool facts = head.size() == 2;
  std::string text = fmt::format("<div class=\"scroll\"><table{}>\n<thead><tr>",
                                 facts ? " class=\"facts-table\"" : "");
  for (std::size_t k = 0; k < head.size(); ++k)
    text += fmt::format("<th{}>{}</th>", k == 0 ? " class=\"words\"" : "", head[k]);
  text += "</tr></thead>\n<tbody>\n";
  for (const auto& row : rows) {
    text += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k)
      text += fmt::format("<td{}>{}</td>", k == 0 ? " class=\"words\"" : "", row[k]);
    text += "</tr>\n";
  }
  return text + "</tbody></table></div>\n";
}

std::string folded(const std::string& heading, const std::string& content) {
  return fmt::format("<details><summary>{}</summary>\n{}</details>\n", heading, content);
}

}  // namespace lahar
