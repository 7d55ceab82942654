// Memory that what a scenario describes takes, before it is taken.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"
#include "physics/particles/columns.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::refuse_memory(const JsonValue& at, double bytes,
                                         const std::string& what) {
  Problem problem = too_much_memory(bytes, what, in_.memory);
  in_.error(at, std::move(problem.message), std::move(problem.hint));
  throw InputError(in_.problems.errors(in_.file));
}

template <int Dim>
void ScenarioBuilder<Dim>::need_memory(const JsonValue& at, double bytes, const std::string& what) {
  memory_ += bytes;
  if (!std::isfinite(in_.memory.bytes)) return;
  const double most = team_.most({memory_}).front();
  if (most > in_.memory.bytes) refuse_memory(at, most, what);
}

template <int Dim>
Index ScenarioBuilder<Dim>::room_for(double bytes) const {
  constexpr double most = 9e15;  // without a limit
  if (!std::isfinite(in_.memory.bytes)) return static_cast<Index>(most);
  const double taken = team_.most({memory_}).front();
  return static_cast<Index>(std::clamp((in_.memory.bytes - taken) / bytes, 0.0, most));
}

namespace {

/// A particle in ParticleTable and, when it is copied from there, in the patches [bytes], at least.
template <int Dim>
double particle_bytes() {
  const double table =
      2 * sizeof(Vec<Dim>) + sizeof(Index) + sizeof(double) + sizeof(std::uint16_t);
  return table + sizeof(double) * static_cast<double>(ColumnLayout<Dim>().rows());
}

}  // namespace

template <int Dim>
double ScenarioBuilder<Dim>::with_particles(Index count) const {
  return memory_ + particle_bytes<Dim>() * static_cast<double>(count) / team_.size();
}

template <int Dim>
void ScenarioBuilder<Dim>::need_particles(const JsonValue& at, Index count) {
  need_memory(at, with_particles(count) - memory_,
              fmt::format("this and {} particles", format_count(count)));
}

template <int Dim>
NewParticles<Dim> ScenarioBuilder<Dim>::fill(const JsonValue& generator, const Region<Dim>& region,
                                             int per_cell, CutCells cut) {
  phase("particles of a region");
  const ParticleLimit limit{room_for(particle_bytes<Dim>()), [&](Index count) {
                              refuse_memory(
                                  generator, with_particles(count),
                                  fmt::format("{} particles or more", format_count(count)));
                            }};
  auto fresh = fill_region<Dim>(*mesh_, region, per_cell, team_, limit, cut);
  need_particles(generator, team_.sum(static_cast<Index>(fresh.x.size())));
  return fresh;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
