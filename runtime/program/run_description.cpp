#include "runtime/program/run_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string>

#include "physics/base/error.h"
#include "physics/materials/law.h"
#include "physics/particles/patch_split.h"
#include "runtime/step/output_times.h"

namespace lahar {

namespace {

/// Steps that are to be taken; an adaptive step is taken not to change.
double steps_of(const Analysis& analysis, const SimulationInfo& info) {
  const double by_time = std::ceil(analysis.end_time / info.dt * (1 - rounding_of_multiples));
  return std::min(by_time, static_cast<double>(analysis.nsteps)) -
         static_cast<double>(analysis.first_step);
}

}  // namespace

const char* scheme_name(Scheme scheme) {
  switch (scheme) {
    case Scheme::usf:
      return "USF";
    case Scheme::usl:
      return "USL";
    case Scheme::musl:
      return "MUSL";
    case Scheme::newmark:
      return "Newmark";
    case Scheme::projection:
      return "projection";
  }
  return "";
}

std::size_t count_materials(std::span<const Material> materials) {
  std::set<Index> ids;
  for (const Material& material : materials) ids.insert(material.id);
  return ids.size();
}

ModelOutline outline_of(const AnyModel& any) {
  return std::visit(
      []<int Dim>(const Model<Dim>& model) {
        const Mesh<Dim>& mesh = *model.mesh;
        std::vector<std::uint16_t> given;
        for (const auto& change : model.changes.materials) given.push_back(change.material);
        std::vector<double> times;
        for (const auto& removal : model.changes.removed) times.push_back(removal.over);
        std::vector<std::string> sides;
        for (const RigidBody<Dim>& side : model.sides) sides.push_back(side.name);
        return ModelOutline{
            .dim = Dim,
            .title = model.title,
            .mesh = mesh.is_structured()    ? "structured"
                    : mesh.is_cartesian()   ? "from a table, Cartesian"
                    : mesh.is_multilinear() ? "from a table, isoparametric"
                                            : info(mesh.element()).name,
            .materials = model.materials,
            .analysis = model.analysis,
            .output = model.output,
            .new_materials = std::move(given),
            .removal_times = std::move(times),
            .curved_cell = info(mesh.element()).order == 2 ? mesh.mean_cell().minCoeff() : 0.0,
            .sides = std::move(sides)};
      },
      any);
}

std::vector<BodyShape> shapes_of_bodies(const AnyModel& any) {
  return std::visit(
      []<int Dim>(const Model<Dim>& model) {
        constexpr double all = Dim == 2 ? 100'000 : 400'000, most = all / 2, least = all / 40;
        const double points =
            std::clamp(all / static_cast<double>(model.rigid_bodies.size()), least, most);
        std::vector<BodyShape> shapes;
        for (const RigidBody<Dim>& body : model.rigid_bodies) {
          BodyShape& shape = shapes.emplace_back();
          shape.name = body.name;
          std::copy_n(body.centre.data(), Dim, shape.centre.begin());
          shape.surface = surface_within<Dim>(*body.solid, model.mesh->bounds(), points);
        }
        return shapes;
      },
      any);
}

/// The velocity transfer in words.
std::string describe_transfer(const Analysis& analysis, std::span<const Material> materials) {
  const VelocityTransfer& transfer = analysis.transfer;
  const std::string affine = analysis.affine == Affine::apic   ? "APIC"
                             : analysis.affine == Affine::tpic ? "TPIC"
                                                               : "";
  if (transfer.separation > 0.0) {
    Analysis without = analysis;
    without.transfer.separation = 0.0;
    return "ASFLIP: " + describe_transfer(without, materials);
  }
  const bool all = transfer.rates.empty() ? transfer.flip == 0.0 : std::isinf(transfer.rates[0]);
  if (!transfer.takes()) return affine.empty() ? "FLIP" : affine + " and FLIP";
  const std::string order =
      !affine.empty() ? affine
      : transfer.order == 1
          ? "PIC"
          : fmt::format("{} of order {}", transfer.filters_change ? "FMPM" : "XPIC",
                        transfer.order);
  if (all) return order;
  if (transfer.rates.empty()) return fmt::format("{:g} FLIP, the rest {}", transfer.flip, order);
  std::string times, viscosities;
  bool by_cells = false;
  for (std::size_t body = 0; body < transfer.rates.size(); ++body) {
    const double viscosity = transfer.rates[body] * transfer.smoothing;  // [m^2/s]
    const char* comma = body == 0 ? "" : ", ";
    times += fmt::format("{}{:.3g}", comma, 1.0 / transfer.rates[body]);
    viscosities += fmt::format("{}{:.3g}", comma, viscosity);
    by_cells |= viscosity > 1.001 * transfer.viscosity;
  }
  std::string text = fmt::format("FLIP that becomes {} in {} s", order, times);
  if (transfer.smoothing > 0.0)
    text += fmt::format(", as a viscosity of {} m^2/s{}", viscosities,
                        by_cells ? ", less with finer cells" : "");
  else if (transfer.viscous > 0.0)
    text += fmt::format(", with a viscosity of {:.3g} m^2/s", transfer.viscosity);
  else if (transfer.viscosity_length > 0.0)
    text += fmt::format(", with a viscosity of {:.3g} m times sqrt(p / density)",
                        transfer.viscosity_length);
  if (transfer.rates.size() > 1) {
    std::string names;
    for (int body = 0; body < analysis.contact.bodies; ++body)
      for (const Material& material : materials)
        if (material.body == body) {
          names += fmt::format("{}'{}'", body == 0 ? "" : ", ", printable(material.name));
          break;
        }
    text += fmt::format(" (bodies of {})", names);
  }
  return text;
}

void describe(Console& console, const ModelOutline& model, const SimulationInfo& info, int ranks) {
  console.line(
      fmt::format("case       {}", model.title.empty() ? "(untitled)" : printable(model.title)));
  console.line(ranks == 1 ? fmt::format("threads    {} on 1 rank", info.threads)
                          : fmt::format("threads    {} on each of {} ranks", info.threads, ranks));
  console.line(fmt::format("mesh       {} cells, {} nodes ({})", format_count(info.cells),
                           format_count(info.nodes), model.mesh));
  if (!model.sides.empty())
    console.line(fmt::format("  sides    {} hold{} free rigid bodies", fmt::join(model.sides, ", "),
                             model.sides.size() == 1 ? "s" : ""));
  const std::size_t materials = count_materials(model.materials);
  console.line(fmt::format("particles  {}, {} material{}", format_count(info.particles), materials,
                           materials == 1 ? "" : "s"));
  const bool implicit = is_implicit(model.analysis);
  const std::string scheme = implicit && model.analysis.implicit.quasi_static
                                 ? "implicit, quasi-static"
                                 : fmt::format("{}, {}", scheme_name(model.analysis.scheme),
                                               describe_transfer(model.analysis, model.materials));
  const Plane plane = model.analysis.plane;
  console.line(fmt::format("scheme     {}{}{}", scheme, model.analysis.mean_volume ? ", B-bar" : "",
                           plane == Plane::axisymmetric ? ", axisymmetric"
                           : plane == Plane::stress     ? ", plane stress"
                                                        : ""));
  const std::string adaptive =
      model.analysis.step.adaptive
          ? fmt::format(" (adaptive, safety {:g})", model.analysis.step.safety)
          : "";
  const std::string limit = implicit ? "no stability limit"
                            : std::isinf(info.dt_limit)
                                ? "no stability limit at rest"
                                : fmt::format("stability limit {:.4g} s", info.dt_limit);
  console.line(fmt::format("time step  {:.4g} s{}, {}", info.dt, adaptive, limit));
  console.line(fmt::format("patches    {} of about {} cells, {} tasks per step", info.patches,
                           format_count(info.cells_per_patch), format_count(info.tasks_per_step)));
  if (model.analysis.split_steps > 0)
    console.line(fmt::format(
        "  split    where they hold more than {} particles after a multiple of {} steps",
        format_count(split_factor * model.analysis.patch_particles),
        format_count(model.analysis.split_steps)));
  console.line(fmt::format("memory     {} for particles and nodes",
                           format_bytes(static_cast<double>(info.bytes))));
}

void describe_loads(Console& console, std::span<const std::string> loads) {
  constexpr std::size_t most = 5;
  const std::size_t shown = loads.size() > most ? most - 1 : loads.size();
  for (std::size_t k = 0; k < shown; ++k)
    console.line(fmt::format("{:<10} {}", k == 0 ? "loads" : "", loads[k]));
  if (shown < loads.size())
    console.line(
        fmt::format("{:<10} ... ({} in all)", "", format_count(static_cast<Index>(loads.size()))));
}

double estimated_seconds(const ModelOutline& model, const SimulationInfo& info) {
  if (begins_with_solve(model.analysis)) return std::numeric_limits<double>::infinity();
  const Analysis& a = model.analysis;
  constexpr double flat = 25e-9, solid = 45e-9;   // [s] per particle and step
  constexpr double wide = 2.5;                    // functions that reach beyond a cell
  constexpr double yielding = 1.7, filter = 0.3;  // a law; an order more of the transfer
  const bool yields =
      std::any_of(model.materials.begin(), model.materials.end(), [](const Material& m) {
        return !std::holds_alternative<LinearElastic>(m.law) &&
               !std::holds_alternative<NeoHookean>(m.law) && !has_pressure(m.law);
      });
  const double one = (model.dim == 2 ? flat : solid) *
                     (a.functions == ShapeFunctions::element ? 1.0 : wide) *
                     (yields ? yielding : 1.0) * (1.0 + filter * (a.transfer.order - 1));
  const auto threads = static_cast<double>(std::min<Index>(info.threads, info.patches));
  return one * steps_of(a, info) * static_cast<double>(info.particles) / std::max(threads, 1.0);
}

void describe_duration(Console& console, const ModelOutline& model, const SimulationInfo& info) {
  constexpr double day = 86400, minute = 60, hour = 3600;
  const double seconds = estimated_seconds(model, info);
  if (!std::isfinite(seconds)) return;  // nobody can tell
  const auto about = [](double number, const char* unit) {
    const std::string digits = fmt::format("{:.2g}", number);
    return fmt::format("{} {}{}", digits, unit, digits == "1" ? "" : "s");
  };
  const std::string text = seconds < minute ? "less than a minute"
                           : seconds < hour ? about(seconds / minute, "minute")
                           : seconds < day  ? about(seconds / hour, "hour")
                                            : about(seconds / day, "day");
  const std::string steps =
      fmt::format("{}{} steps", model.analysis.step.adaptive ? "about " : "",
                  format_count(static_cast<Index>(std::ceil(steps_of(model.analysis, info)))));
  const std::string threads =
      fmt::format("{} thread{}", info.threads, info.threads == 1 ? "" : "s");
  console.line(fmt::format("duration   {} on {}, as a rough estimate ({})", text, threads, steps));
  if (seconds > day)
    console.warn(fmt::format(
        "lahar: warning: the run may take {} on {}, as a rough estimate: {} of {:.3g} s with {} "
        "particles. Larger cells, softer materials, or more threads and ranks make it shorter.",
        text, threads, steps, info.dt, format_count(info.particles)));
}

void describe_frames(Console& console, const OutputPlan& plan, const Analysis& analysis,
                     const SimulationInfo& info) {
  const double steps = steps_of(analysis, info);
  double frames = 0;  // beside the first
  if (plan.frame_steps > 0) frames = steps / static_cast<double>(plan.frame_steps);
  if (plan.frame_dt > 0) frames = std::min(analysis.end_time, steps * info.dt) / plan.frame_dt;
  if (!(frames < 1e15)) return;  // nobody can tell
  const auto whole = static_cast<Index>(frames + rounding_of_multiples);
  const bool ends_with_one = frames - static_cast<double>(whole) < rounding_of_multiples;
  const bool too_many = whole > plan.max_frames;
  const bool last = frames > 0 && (too_many || !ends_with_one);
  const Index all = 1 + std::min(whole, plan.max_frames) + last;
  const auto bytes = static_cast<double>(info.all_frame_bytes);
  // An adaptive step may become another.
  console.line(fmt::format(
      "frames     {}{} of {}, {}", analysis.step.adaptive && plan.frame_steps > 0 ? "about " : "",
      format_count(all), format_bytes(bytes), format_bytes(bytes * static_cast<double>(all))));
  if (too_many)
    console.warn(fmt::format(
        "lahar: warning: {} frames are planned, of which post_processing.max_frames allows {}; "
        "after these only the last state is written.",
        format_count(whole), format_count(plan.max_frames)));
}

void describe_ranks(Console& console, const PatchGraph& graph, std::span<const Index> particles,
                    int ranks, Partitioner partitioner) {
  const std::vector<int> owner = partition(partitioner, graph, ranks);
  const RankShares shares = shares_of(graph, owner, ranks);
  std::vector<Index> held(shares.ranks.size(), 0);
  for (std::size_t p = 0; p < owner.size(); ++p)
    held[static_cast<std::size_t>(owner[p])] += particles[p];
  console.line(fmt::format(
      "ranks      {}, work of the heaviest {:.3f} times the mean, edge cut {} shared nodes",
      format_count(ranks), shares.imbalance(), format_count(shares.edge_cut)));
  console.line(fmt::format("  {:>9} {:>9} {:>13} {:>13} {:>11}", "rank", "patches", "particles",
                           "shared nodes", "neighbours"));
  Index idle = 0;
  for (std::size_t r = 0; r < shares.ranks.size(); ++r) {
    const RankShare& rank = shares.ranks[r];
    idle += held[r] == 0;
    console.line(fmt::format("  {:>9} {:>9} {:>13} {:>13} {:>11}", r, format_count(rank.patches),
                             format_count(held[r]), format_count(rank.shared_nodes),
                             rank.neighbours));
  }
  if (idle > 0)
    console.warn(
        fmt::format("lahar: warning: {} of {} ranks would have no particles: a patch is "
                    "the least that a rank can own. Use fewer ranks, or smaller patches "
                    "(analysis.patch_particles).",
                    format_count(idle), format_count(ranks)));
}

Simulation make_simulation(Scenario& scenario, const ExecutionOptions& options, Observer observer,
                           const SimulationState* state) {
  AnyModel& model = scenario.model;
  try {
    return state ? Simulation(std::move(model), options, std::move(observer), *state)
                 : Simulation(std::move(model), options, std::move(observer));
  } catch (const InputError& error) {
    std::vector<Problem> placed;
    for (const Problem& problem : error.problems()) placed.push_back(scenario.place(problem));
    throw InputError(std::move(placed));
  }
}

std::vector<std::string> describe_changes(const ChangedParticles& changed,
                                          std::span<const Material> materials,
                                          std::span<const std::uint16_t> given,
                                          std::span<const double> removal_times) {
  const auto count = [](const ParticleCount& of) {
    return fmt::format("{} particle{} ({:.6g} kg)", format_count(of.particles),
                       of.particles == 1 ? "" : "s", of.mass);
  };
  std::vector<std::string> lines;
  for (std::size_t k = 0; k < changed.removed.size(); ++k)
    lines.push_back(removal_times[k] > 0
                        ? fmt::format("{} {} within {:.6g} s", count(changed.removed[k]),
                                      changed.removed[k].particles == 1 ? "goes" : "go",
                                      removal_times[k])
                        : fmt::format("{} removed", count(changed.removed[k])));
  for (std::size_t k = 0; k < changed.materials.size(); ++k)
    lines.push_back(
        fmt::format("{} became {}", count(changed.materials[k]), materials[given[k]].name));
  if (changed.placed.particles > 0)
    lines.push_back(fmt::format("{} placed", count(changed.placed)));
  return lines;
}

}  // namespace lahar
