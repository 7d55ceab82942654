// Bodies of generated scenarios: where particles come from.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

constexpr double bed_height = 0.3;  ///< cells that a rigid body has below all others

/// A body's place, in cells: its lowest corner, and its edges.
struct Place {
  std::vector<double> low, size;
};

Place place_of(Choices& choices, const Outline& outline, int body) {
  Place place;
  for (int d = 0; d < outline.dim; ++d) {
    const std::string of = name("body", body, "axis") + std::to_string(d);
    const int room = outline.counts[static_cast<std::size_t>(d)];
    const int size = std::min(room - 1, (outline.dim == 2 ? 3 : 2) + choices.pick(of + ".size", 3));
    // Bodies beside each other as a rule; those that overlap are in contact at once.
    const int low = d == 0 ? body * room / outline.bodies : 1;
    place.size.push_back(size);
    place.low.push_back(std::clamp(low + choices.pick(of + ".place", 5), 0, room - size));
  }
  const auto up = static_cast<std::size_t>(outline.dim) - 1;
  if (outline.solves == "equilibrium" && !choices.chance(name("body", body, "falls"), 10))
    place.low[up] = choices.chance("rigid", 30) ? bed_height : 0;
  place.low.resize(3, 0.0);
  place.size.resize(3, 0.0);
  return place;
}

std::vector<double> upper(const Place& place) {
  std::vector<double> high = place.low;
  for (std::size_t d = 0; d < high.size(); ++d) high[d] += place.size[d];
  return high;
}

Json box_of(const Outline& outline, const Place& place) {
  return {{"min", point(outline, place.low)}, {"max", point(outline, upper(place))}};
}

Json velocity_of(Choices& choices, const Outline& outline, int body) {
  Json velocity = Json::array();
  for (int d = 0; d < outline.dim; ++d)
    velocity.push_back(choices.number(name("body", body, "velocity") + std::to_string(d), 0,
                                      -outline.speed, outline.speed));
  return velocity;
}

/// Points of a body that are no lattice.
std::string scattered(const Outline& outline, const Place& place, int body) {
  const int n = outline.dim == 2 ? 60 : 150;
  std::string text = fmt::format("{}\n", n);
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < outline.dim; ++d) {  // a sequence that fills the box evenly
      const auto k = static_cast<std::size_t>(d);
      const double turns = (i + 1) * std::sqrt(2.0 + 3.0 * d + body);
      const double share = turns - std::floor(turns);
      text += fmt::format("{:.9g} ", (place.low[k] + place.size[k] * share) * outline.h[k]);
    }
    text += "\n";
  }
  return text;
}

bool is_simplex(const Outline& outline) {
  return outline.element.find('T') != std::string::npos;
}

/// The region becomes one that names shapes.
void take_shape(Choices& choices, const std::string& own, const Outline& outline, int body,
                Json& generator) {
  const Json box = generator["region"].value("box", Json::object());
  generator["region"] = shape_region_of(choices, own, outline, box);
  if (choices.chance(own + "cut", 30)) generator["cut_cells"] = "centres";
  if (!generator["region"].contains("between") || !choices.chance(own + "layers", 50)) return;
  generator.erase("material");
  generator["layers"] = {{{"below", "ground"}, {"material", material_of(outline, body)}},
                         {{"below", "middle"}, {"material", material_of(outline, body + 1)}}};
}

Json generator_of(Choices& choices, const Outline& outline, int body, GeneratedCase& made,
                  Json& sets) {
  const Place place = place_of(choices, outline, body);
  const std::string own = name("body", body, "");
  const int most = outline.dim == 2 ? 3 : 2;
  // The first body is there from the beginning as a rule: its particles are a set.
  const bool can_inject = body > 0 && !outline.stages && !outline.fields && outline.solves.empty();
  const int kind = choices.pick(own + "kind", can_inject ? 6 : 4);
  Json generator;
  const auto fill_cells = [&](const char* type) {
    const std::string cells = fmt::format("cells{}", body);
    sets["cells"][cells]["box"] = box_of(outline, place);
    generator = {{"type", type}, {"cset", cells}};
    generator["nparticles_per_dir"] =
        1 + choices.pick(own + "points", is_simplex(outline) ? 2 : most);
  };
  if (kind <= 1) {
    generator = {{"type", "region"}, {"per_cell", 1 + choices.pick(own + "per_cell", most)}};
    if (kind == 0) {
      generator["region"]["box"] = box_of(outline, place);
    } else {
      std::vector<double> centre = place.low;
      for (std::size_t d = 0; d < centre.size(); ++d) centre[d] += 0.5 * place.size[d];
      generator["region"]["sphere"] = {{"centre", point(outline, centre)},
                                       {"radius", 0.05 * (place.size[0] + 0.5)}};
    }
  } else if (kind == 2) {
    fill_cells("gauss");
  } else if (kind == 3) {
    const std::string file = fmt::format("body{}.txt", body);
    made.files[file] = scattered(outline, place, body);
    generator = {{"type", "file"}, {"location", file}};
  } else {
    fill_cells("inject");
    if (choices.chance(own + "limited", 50))
      generator["duration"] = {choices.chance(own + "late", 50) ? 0.02 : 0.0, 0.08};
  }
  generator["material"] = material_of(outline, body);
  if (kind < 2 && outline.shapes && choices.chance(own + "shaped", 70))
    take_shape(choices, own, outline, body, generator);
  generator["velocity"] = velocity_of(choices, outline, body);
  const std::string set = fmt::format("body{}", body);
  if (generator.contains("layers"))
    for (Json& layer : generator["layers"]) layer["pset"] = set;
  else if (kind < 4)
    generator["pset"] = set;
  return {{"generator", generator}};
}

}  // namespace

Json bodies_of(Choices& choices, const Outline& outline, GeneratedCase& made, Json& sets) {
  Json all = Json::array();
  for (int body = 0; body < outline.bodies; ++body)
    all.push_back(generator_of(choices, outline, body, made, sets));
  return all;
}

Json rigid_bodies_of(Choices& choices, const Outline& outline) {
  Json all = Json::array();
  const bool fits = outline.scheme != "usl" && !outline.second_order && !outline.cbgeo &&
                    outline.plane != "stress" && !outline.projects() &&
                    (!outline.pores || outline.scheme == "musl");
  if (!fits || !choices.chance("rigid", 30)) return all;
  const int up = outline.dim - 1;
  const auto at = [&](double share, double cells) {  // share of the extent along all but the last
    std::vector<double> place;
    for (int d = 0; d < outline.dim; ++d)
      place.push_back(d == up ? cells : share * outline.counts[static_cast<std::size_t>(d)]);
    return point(outline, place);
  };
  const auto along_last = [&](double value) {
    Json v = Json::array();
    for (int d = 0; d < outline.dim; ++d) v.push_back(d == up ? value : 0.0);
    return v;
  };
  const double friction = choices.number("rigid.friction", 0.4, 0, 1);
  all.push_back(
      {{"region", {{"half_space", {{"point", at(0, bed_height)}, {"normal", along_last(1)}}}}},
       {"friction", friction}});
  if (outline.shapes && choices.chance("rigid.bed", 60)) all[0]["region"] = {{"below", "bed"}};
  if (choices.chance("rigid.sticky", 30)) all[0]["cohesion"] = 50;
  if (!outline.pores && !outline.is_implicit() && choices.chance("rigid.free", 60))
    all.push_back(
        {{"region", {{"sphere", {{"centre", at(0.5, 0.65)}, {"radius", 0.3 * outline.h.back()}}}}},
         {"density", choices.number("rigid.density", 2000, 100, 5000)},
         {"velocity", along_last(choices.number("rigid.speed", 2, 0, 3))},
         {"friction", friction}});
  if (all.size() == 2) all[1]["restitution"] = choices.number("rigid.restitution", 0.5, 0, 1);
  if (all.size() == 2 && outline.plane != "axisymmetric" && choices.chance("rigid.spins", 40))
    all[1]["spin"] = outline.dim == 2 ? Json(4) : Json{1, 3, -2};
  if (outline.shapes && outline.dim == 3 && all.size() == 2 && choices.chance("rigid.stone", 60))
    all[1]["region"] = {{"inside", "stone"}};
  if (choices.chance("rigid.tool", 40)) {
    Json tool{{"region", {{"box", {{"min", at(0.1, 0.35)}, {"max", at(0.35, 0.9)}}}}},
              {"velocity", along_last(choices.number("rigid.lift", 1, 0, 2))}};
    const int function = choices.pick("rigid.function", outline.functions_of_time + 1);
    if (function > 0) tool["math_function_id"] = function - 1;
    all.push_back(tool);
  }
  return all;
}

Json loads_of(Choices& choices, const Outline& outline, Json& sets) {
  Json loads = Json::object();
  if (choices.chance("gravity", 50) || outline.k0 || outline.ends_at_rest) {
    Json gravity = Json::array();
    for (int d = 0; d < outline.dim; ++d)
      gravity.push_back(d == outline.dim - 1 ? -9.81
                        : outline.plane == "axisymmetric" || outline.k0
                            ? 0.0
                            : choices.number(name("gravity", d, "side"), 0, -5, 5));
    if (!outline.k0 && choices.chance("gravity.ramp", 20))
      loads["gravity"] = {{"gravity", gravity}, {"ramping_time", 0.05}};
    else
      loads["gravity"] = gravity;
  }
  const auto with_function = [&](const std::string& of, Json load) {
    const int function = choices.pick(of, outline.functions_of_time + 1);
    if (function > 0) load["math_function_id"] = function - 1;
    return load;
  };
  const auto axis = [&](const std::string& of) { return choices.pick(of, outline.dim); };
  const int tractions = choices.chance("tractions", 25) ? 1 + choices.pick("tractions.more", 2) : 0;
  for (int i = 0; i < tractions; ++i) {
    Json traction{{"dir", axis(name("traction", i, "axis"))},
                  {"traction", choices.number(name("traction", i, "size"), 500, -1000, 1000)}};
    const int where = choices.pick(name("traction", i, "where"), 3);
    if (where == 1)
      sets["particles"]["pushed"]["half_space"] = {
          {"point", point(outline, {4, 3, 3})},
          {"normal", outline.dim == 2 ? Json{1, 0.5} : Json{1, 0.5, 0}}};
    traction[where == 2 ? "pset_id" : "pset"] =
        where == 2 ? Json(-1) : Json(where == 1 ? "pushed" : "body0");
    loads["particle_surface_traction"].push_back(
        with_function(name("traction", i, "function"), traction));
  }
  if (choices.chance("nodal_force", 15)) {
    sets["nodes"]["forced"]["box"] = {{"min", point(outline, {3, 2, 2})},
                                      {"max", point(outline, {5, 4, 4})}};
    loads["concentrated_nodal_forces"] = Json::array(
        {with_function("nodal_force.function",
                       {{"nset", "forced"}, {"dir", axis("nodal_force.axis")}, {"force", 0.5}})});
  }
  return loads;
}

Json functions_of(Choices& choices, const Outline& outline) {
  Json all = Json::array();
  for (int i = 0; i < outline.functions_of_time; ++i) {
    if (choices.chance(name("function", i, "sine"), 50))
      all.push_back({{"type", "Sin"}, {"x0", 0.01}, {"a", 60}});
    else
      all.push_back({{"type", "Linear"}, {"xvalues", {0, 0.05, 0.1}}, {"fxvalues", {0, 1, -0.5}}});
    if (!outline.cbgeo && choices.chance(name("function", i, "derivative"), 20)) {
      all.back()["derivative"] = true;
      if (all.back().contains("fxvalues")) all.back()["fxvalues"] = {0, 0.05, 0.02};
    }
  }
  return all;
}

}  // namespace lahar::test
