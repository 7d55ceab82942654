// What generated scenarios measure.
#include <fmt/format.h>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

/// A place, in shares of the mesh.
Json place(const Outline& outline, const std::vector<double>& shares, int axes) {
  Json at = Json::array();
  for (int d = 0; d < axes; ++d)
    at.push_back(shares[static_cast<std::size_t>(d)] * outline.extent(d));
  return at;
}

Json fields_of(Choices& choices, const std::string& of) {
  Json fields{"velocity", "stress"};
  if (choices.chance(of + "derived", 50)) fields.push_back("von_mises_stress");
  if (choices.chance(of + "more", 50)) fields.push_back("displacement");
  return fields;
}

/// The gauge counts all particles, or those of a material or of a set.
void add_filter(Choices& choices, const std::string& of, const Outline& outline, Json& gauge) {
  switch (choices.pick(of + "filter", 3)) {
    case 1:
      gauge["material"] = choices.pick(of + "material", static_cast<int>(outline.solids()));
      break;
    case 2:
      gauge["pset"] = "tracked";
      break;
    default:
      break;
  }
}

Json gauge_of(Choices& choices, const std::string& of, const Outline& outline, int kind) {
  const int dim = outline.dim;
  const auto vector = [&](double x, double y, double z) {
    return dim == 2 ? Json{x, y} : Json{x, y, z};
  };
  Json gauge;
  switch (kind) {
    case 0:
      gauge = {{"type", "point"}, {"at", place(outline, {0.4, 0.3, 0.4}, dim)}};
      gauge["fields"] = fields_of(choices, of);
      break;
    case 1:
      gauge = {{"type", "line"}, {"places", 4}};
      gauge["from"] = place(outline, {0, 0.2, 0.3}, dim);
      gauge["to"] = place(outline, {1, 0.6, 0.3}, dim);
      gauge["fields"] = fields_of(choices, of);
      if (choices.chance(of + "radius", 50)) gauge["radius"] = 0.23;
      break;
    case 2:
      gauge = {{"type", "column"}, {"at", place(outline, {0.5, 0.5}, dim - 1)}};
      break;
    case 3:
      gauge = {{"type", "section"}, {"places", 5}};
      gauge["from"] = place(outline, {0, 0.1}, dim - 1);
      gauge["to"] = place(outline, {1, 0.9}, dim - 1);
      break;
    case 4:
      gauge = {{"type", "front"}, {"direction", vector(1, 0.2, 0)}};
      break;
    case 5:
      gauge = {{"type", "plane"}, {"normal", vector(1, 0.5, 0)}};
      gauge["at"] = place(outline, {0.55, 0.2, 0.2}, dim);
      break;
    case 6:
      gauge = {{"type", "particles"}};
      break;
    case 7:
      gauge = {{"type", "track"}, {"pset", "tracked"}, {"fields", fields_of(choices, of)}};
      return gauge;
    default:
      gauge = {{"type", "force"}, {"nset", "felt"}, {"at", place(outline, {0.5, 0, 0}, dim)}};
      return gauge;
  }
  add_filter(choices, of, outline, gauge);
  return gauge;
}

}  // namespace

void add_gauges(Choices& choices, const Outline& outline, double dt, Json& output, Json& sets) {
  if (!outline.gauges) return;
  sets["particles"]["tracked"]["box"] = {{"min", point(outline, {2, 1, 1})},
                                         {"max", point(outline, {7, 6, 5})}};
  Json all = Json::array();
  sets["nodes"]["felt"]["box"] = {{"min", point(outline, {0, 0, 0})},
                                  {"max", place(outline, {1, 0.1, 1}, outline.dim)}};
  for (int kind = 0; kind < 9; ++kind) {
    const bool columns = kind == 2 || kind == 3;
    if (columns && outline.plane == "axisymmetric") continue;
    if (kind == 8 && outline.pores) continue;  // where damping may not be measured
    if (!choices.chance(name("gauge", kind, "there"), 50)) continue;
    all.push_back(gauge_of(choices, name("gauge", kind, ""), outline, kind));
    all.back()["name"] = fmt::format("gauge{}", kind);
  }
  if (!all.empty()) output["gauges"] = all;
  if (outline.dim == 3 && choices.chance("maps", 60)) {
    output["maps"] = Json::object();
    if (choices.chance("maps.cell", 50)) output["maps"]["cell_size"] = 0.13;
    if (choices.chance("maps.part", 30)) output["maps"]["min"] = {0.1, 0.17};
  }
  switch (choices.pick("gauges.rows", 3)) {
    case 1:
      output["gauge_steps"] = 1 + choices.pick("gauges.steps", 12);
      break;
    case 2:
      output["gauge_dt"] = choices.number("gauges.dt", 1, 0.3, 4) * dt;
      break;
    default:
      break;
  }
}

}  // namespace lahar::test
