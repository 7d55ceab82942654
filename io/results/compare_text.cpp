// The result of a comparison as a table.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/results/compare.h"

namespace lahar {

namespace {

using Row = std::array<std::string, 6>;

std::string number(double value) {
  return value == 0 ? "0" : fmt::format("{:.3g}", value);
}

const char* word(FieldDifference::Verdict verdict) {
  switch (verdict) {
    case FieldDifference::Verdict::same:
      return "same";
    case FieldDifference::Verdict::within:
      return "within";
    case FieldDifference::Verdict::differs:
      return "DIFFERS";
    case FieldDifference::Verdict::missing:
      return "MISSING";
  }
  return "";
}

Row row_of(const FieldDifference& d) {
  Row row{d.name, d.unit, "-", "-", "-", word(d.verdict)};
  if (d.verdict == FieldDifference::Verdict::missing) return row;
  row[2] = d.not_finite > 0 ? fmt::format("{} NaN or inf", d.not_finite) : number(d.absolute);
  if (d.not_finite == 0) row[3] = d.floored && d.absolute > 0 ? "floor" : number(d.relative);
  if (d.at >= 0)
    row[4] = d.component.empty() ? std::to_string(d.at) : fmt::format("{} ({})", d.at, d.component);
  return row;
}

std::string table(const std::vector<FieldDifference>& fields) {
  std::vector<Row> rows{{"field", "unit", "max |A-B|", "relative", "at particle", "verdict"}};
  for (const FieldDifference& d : fields) rows.push_back(row_of(d));
  std::array<std::size_t, 6> width{};
  for (const Row& row : rows)
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
  std::string text;
  for (const Row& row : rows)
    text += fmt::format("{:<{}}  {:<{}}  {:>{}}  {:>{}}  {:>{}}  {}\n", row[0], width[0], row[1],
                        width[1], row[2], width[2], row[3], width[3], row[4], width[4], row[5]);
  return text;
}

std::string missing_text(const MissingIds& missing, const char* side) {
  if (missing.count == 0) return {};
  const bool more = missing.count > static_cast<Index>(missing.first.size());
  return fmt::format("{} particle{} only in {}: {}{}\n", missing.count,
                     missing.count == 1 ? "" : "s", side, fmt::join(missing.first, ", "),
                     more ? ", ..." : "");
}

}  // namespace

std::string Comparison::text() const {
  std::string text = fmt::format("A: {} ({} particles)\nB: {} ({} particles)\n\n", name_a, count_a,
                                 name_b, count_b);
  text += table(fields) + '\n';
  text += missing_text(only_in_a, "A") + missing_text(only_in_b, "B");
  for (const std::string& problem : problems) text += problem + '\n';
  for (const std::string& note : notes) text += note + '\n';
  const bool floored = std::any_of(fields.begin(), fields.end(), [](const FieldDifference& d) {
    return d.floored && d.absolute > 0;
  });
  if (floored)
    text += fmt::format(
        "floor: at most {:g} in all of B (strains: {:g}), rounding noise about zero; compared "
        "absolutely\n",
        tolerances.floor, std::min(tolerances.floor, strain_floor));
  text += fmt::format("{}: {} particles compared, rtol {:g}, atol {:g}, floor {:g}\n",
                      passed ? "AGREE" : "DIFFERENT", matched, tolerances.rtol, tolerances.atol,
                      tolerances.floor);
  return text;
}

}  // namespace lahar
