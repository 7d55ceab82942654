#include "runtime/bench/bench_traffic.h"

#include <algorithm>

namespace lahar {

namespace {

using enum Column;

std::vector<TrafficPhase> phases_of_boxes(Scheme scheme) {
  switch (scheme) {
    case Scheme::usl:
      return {{"integrate stress G2P locate P2G force",
               {x, v, u, stress, volume, mass},
               {x, v, u, stress, volume}}};
    case Scheme::usf:
      return {{"velocity stress force", {x, stress, volume}, {stress, volume}},
              {"integrate G2P locate P2G", {x, v, u, mass}, {x, v, u}}};
    case Scheme::musl:
      return {{"integrate G2P P2G remap", {x, xi, v, u, mass}, {x, v, u}},
              {"velocity stress locate P2G force",
               {x, xi, v, stress, volume, mass},
               {xi, stress, volume}}};
    case Scheme::newmark:  // not measured
    case Scheme::projection:
      break;
  }
  return {};
}

/// Adds the columns of a liquid in pores. Its velocity belongs to phases in which particles move,
/// its pressure to those in which the skeleton is strained.
void add_liquid(TrafficPhase& phase, bool moves, bool strains) {
  if (moves) {
    phase.reads.push_back(liquid_v);
    phase.writes.push_back(liquid_v);
  }
  if (strains) {
    phase.reads.push_back(pore_pressure);
    phase.writes.push_back(pore_pressure);
  }
}

/// What CPDI and CPDI2 touch besides: vectors follow strain, corners move with particles.
void add_corners(TrafficPhase& phase, bool moves, bool strains, Scheme scheme, bool of_cpdi2) {
  if (of_cpdi2) {
    const bool musl = scheme == Scheme::musl;
    phase.reads.push_back(Column::corners);
    if (moves) phase.writes.push_back(musl ? next_corners : Column::corners);
    if (!musl || moves) return;
    phase.reads.push_back(next_corners);
    phase.writes.push_back(Column::corners);
    return;
  }
  phase.reads.push_back(vectors);
  if (strains) phase.writes.push_back(next_vectors);
  if (moves) phase.writes.push_back(vectors);
  if (moves && !strains) phase.reads.push_back(next_vectors);
}

}  // namespace

std::vector<TrafficPhase> traffic_phases(const Analysis& analysis, bool cartesian) {
  const Scheme scheme = analysis.scheme;
  std::vector<TrafficPhase> phases = phases_of_boxes(scheme);
  const auto& functions = row_of(analysis.functions);
  const bool stretches = functions.stretches, of_cpdi = functions.domain == ParticleDomain::vectors,
             of_cpdi2 = functions.domain == ParticleDomain::corners;
  for (TrafficPhase& phase : phases) {
    const bool moves = std::count(phase.writes.begin(), phase.writes.end(), x) > 0;
    const bool strains = std::count(phase.writes.begin(), phase.writes.end(), stress) > 0;
    if (analysis.affine != Affine::none) {
      if (std::count(phase.reads.begin(), phase.reads.end(), v) > 0) phase.reads.push_back(affine);
      if (moves) phase.writes.push_back(affine);
    }
    if (analysis.two_phase) add_liquid(phase, moves, strains);
    if (functions.domain == ParticleDomain::box) phase.reads.push_back(domain);
    if (analysis.opening && strains) {
      phase.reads.push_back(opening);
      phase.writes.push_back(opening);
    }
    if (stretches && strains) phase.writes.push_back(next_domain);
    if (stretches && moves) phase.writes.push_back(domain);
    if (stretches && moves && !strains) phase.reads.push_back(next_domain);
    if (of_cpdi || of_cpdi2) add_corners(phase, moves, strains, scheme, of_cpdi2);
  }
  if (cartesian || scheme == Scheme::musl) return phases;  // MUSL keeps xi on any mesh
  for (TrafficPhase& phase : phases) {
    const bool moves = std::count(phase.writes.begin(), phase.writes.end(), x) > 0;
    if (!moves) std::replace(phase.reads.begin(), phase.reads.end(), x, xi);
    if (moves) phase.reads.push_back(xi), phase.writes.push_back(xi);
  }
  return phases;
}

template <int Dim>
double bytes_per_particle_step(const Analysis& analysis, bool cartesian) {
  int components = 0;
  const auto add = [&](const std::vector<Column>& columns) {
    const ColumnLayout<Dim> layout;
    for (const Column column : columns)
      components += layout.components(column_table[static_cast<std::size_t>(column)]);
  };
  for (const TrafficPhase& phase : traffic_phases(analysis, cartesian)) {
    add(phase.reads);
    add(phase.writes);
  }
  return components * static_cast<double>(sizeof(double));
}

template double bytes_per_particle_step<2>(const Analysis&, bool);
template double bytes_per_particle_step<3>(const Analysis&, bool);

}  // namespace lahar
