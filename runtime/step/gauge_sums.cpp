#include "runtime/step/gauge_sums.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/base/error.h"
#include "physics/particles/liquid_content.h"
#include "physics/particles/removal_in_time.h"

namespace lahar {

Index ordered_bits(double value) {
  const auto bits = std::bit_cast<Index>(value);
  return bits < 0 ? bits ^ std::numeric_limits<Index>::max() : bits;
}

double ordered_value(Index bits) {
  return std::bit_cast<double>(bits < 0 ? bits ^ std::numeric_limits<Index>::max() : bits);
}

namespace {

using Kind = Gauge::Kind;

/// Particles that count for a gauge, and where they are.
template <int Dim>
class Counted {
 public:
  Counted(const Gauge& gauge, const Model<Dim>& model, const Particles<Dim>& particles)
      : gauge_(gauge),
        model_(model),
        particles_(particles),
        x_(particles.template rows<Dim>(Column::x)) {}

  bool counts(Local p) const {
    const auto slot = static_cast<std::size_t>(p);
    if (gauge_.material >= 0 &&
        static_cast<int>(model_.materials[particles_.material[slot]].id) != gauge_.material)
      return false;
    return !gauge_.of_set ||
           std::binary_search(gauge_.ids.begin(), gauge_.ids.end(), particles_.id[slot]);
  }
  /// Mass of the liquid in a particle's pores [kg]; 0 without a liquid. It is not inlined: its bits
  /// must not depend on the code around it.
  [[gnu::noinline]] double liquid_mass(Local p) const {
    const auto& liquid = model_.materials[particles_.material[static_cast<std::size_t>(p)]].liquid;
    return compressed_mass_of(liquid, particles_, p);
  }
  double x(int d, Local p) const { return x_[static_cast<std::size_t>(d)][p]; }
  /// Distance from the gauge's origin along its direction [m].
  double position(Local p) const {
    double along = 0;
    for (int d = 0; d < Dim; ++d) {
      const auto k = static_cast<std::size_t>(d);
      along += (x(d, p) - gauge_.origin[k]) * gauge_.direction[k];
    }
    return along;
  }
  /// 1 - d / radius for each of the first `axes` axes, multiplied; 0 beyond the radius.
  double weight(Local p, const std::array<double, 3>& place, int axes) const {
    double weight = 1;
    for (int d = 0; d < axes; ++d) {
      const auto k = static_cast<std::size_t>(d);
      const double factor = 1 - std::abs(x(d, p) - place[k]) / gauge_.radius[k];
      if (!(factor > 0)) return 0;
      weight *= factor;
    }
    return weight;
  }

 private:
  const Gauge& gauge_;
  const Model<Dim>& model_;
  const Particles<Dim>& particles_;
  std::array<const double*, Dim> x_;
};

/// A box, open at its faces: low and high of each axis [m].
using Reach = std::array<std::array<double, 2>, 3>;

/// Particles of a cell may lie in the box; of a cell whose shape is not known here, always. They
/// are in their cell but for rounding, which is much less than the margin.
template <int Dim>
bool may_reach(const Patch<Dim>& patch, Local cell, const Reach& reach, int axes) {
  constexpr double with_margin = 2;  // half edges of the cell from its centre, one more than it has
  if (!patch.cartesian) return true;
  const auto& box = patch.box[static_cast<std::size_t>(cell)];
  for (std::size_t d = 0; d < static_cast<std::size_t>(axes); ++d) {
    const auto [low, high] = reach[d];
    if (std::max(low - box[d], box[d] - high) * box[Dim + d] > with_margin) return false;
  }
  return true;
}

template <int Dim>
class GaugeAdder {
 public:
  GaugeAdder(const OpenGauge<Dim>& open, const Patch<Dim>& patch, const ParticleBlock<Dim>& block,
             const Model<Dim>& model, double time, GaugeSums& all)
      : open_(open),
        gauge_(*open.gauge),
        patch_(patch),
        block_(block),
        model_(model),
        time_(time),
        particles_(*block.particles),
        counted_(gauge_, model, particles_),
        all_(all) {}

  void add() {
    switch (gauge_.kind) {
      case Kind::points:
        return at_places(Dim);
      case Kind::columns:
        return at_places(Dim - 1);
      case Kind::front:
        return front();
      case Kind::plane:
        return plane();
      case Kind::particles:
        return particles();
      case Kind::track:
        return track();
      case Kind::force:  // is not of particles
        return;
    }
  }

 private:
  ExactSum& exact(std::size_t k) { return all_.exact[open_.slots.exact + k]; }
  void least(std::size_t k, double value) {
    Index& found = all_.least[open_.slots.least + k];
    found = std::min(found, ordered_bits(value));
  }
  void for_counted(auto&& body) {
    block_.for_each_range([&](Local begin, Local end) {
      for (Local p = begin; p < end; ++p)
        if (counted_.counts(p)) body(p);
    });
  }

  /// The box around all places with their radii.
  Reach reach() const {
    Reach reach;
    for (std::size_t d = 0; d < 3; ++d) {
      const auto [low, high] =
          std::ranges::minmax(gauge_.places, {}, [d](const auto& place) { return place[d]; });
      reach[d] = {low[d] - gauge_.radius[d], high[d] + gauge_.radius[d]};
    }
    return reach;
  }

  /// The particles in a box, a bin for each.
  std::vector<ParticleBin> particles_in(const Reach& reach, int axes) const {
    std::vector<ParticleBin> near;
    const auto look_at = [&](Local p) {
      for (int d = 0; d < axes; ++d) {
        const auto [low, high] = reach[static_cast<std::size_t>(d)];
        const double x = counted_.x(d, p);
        if (!(x > low && x < high)) return;
      }
      if (counted_.counts(p))
        near.push_back(
            {.cell = -1, .begin = p, .end = p + 1, .limit = p + 1, .material = 0, .loaded = false});
    };
    if (block_.whole)
      for (Local p = 0; p < particles_.size(); ++p) look_at(p);
    for (const ParticleBin& bin : block_.bins)
      if (may_reach(patch_, bin.cell, reach, axes))
        for (Local p = bin.begin; p < bin.end; ++p) look_at(p);
    return near;
  }

  /// Particles around places, each with the numbers of its values in `fields`.
  void at_places(int axes) {
    const std::vector<ParticleBin> near = particles_in(reach(), axes);
    if (near.empty()) return;
    std::vector<std::vector<double>> fields;
    for (const ShownColumn<Dim>& field : open_.fields) {
      fields.emplace_back(near.size() * static_cast<std::size_t>(field.components()));
      field.get({&particles_, near}, fields.back().data());
    }
    for (std::size_t k = 0; k < gauge_.places.size(); ++k)
      for (std::size_t i = 0; i < near.size(); ++i)
        if (const double weight = counted_.weight(near[i].begin, gauge_.places[k], axes);
            weight > 0)
          at_place(k, near[i].begin, weight, fields, i);
  }

  void at_place(std::size_t place, Local p, double weight,
                const std::vector<std::vector<double>>& fields, std::size_t i) {
    const double V = particles_.row(Column::volume)[p], share = weight * V;
    std::size_t k = place * open_.sums_of_place();
    exact(k++) += share;
    if (gauge_.kind == Kind::columns) {
      for (int d = 0; d < Dim; ++d) exact(k++) += share * particles_.row(Column::v, d)[p];
      least(place, -(counted_.x(Dim - 1, p) + 0.5 * std::pow(V, 1.0 / Dim)));
      return;
    }
    for (std::size_t f = 0; f < fields.size(); ++f) {
      const auto width = static_cast<std::size_t>(open_.fields[f].components());
      for (std::size_t c = 0; c < width; ++c) exact(k++) += share * fields[f][i * width + c];
    }
  }

  void front() {
    for_counted([&](Local p) {
      const double position = counted_.position(p);
      least(0, -position);
      least(1, position);
    });
  }

  /// Mass with and without what has left the mesh or goes as a stage says, and volume. Grains and
  /// liquid count.
  void plane() {
    const double *m = particles_.row(Column::mass), *V = particles_.row(Column::volume);
    for_counted([&](Local p) {
      if (!(counted_.position(p) > 0)) return;
      const double share = share_left(model_, particles_, p, time_);
      for (const double part : {m[p], counted_.liquid_mass(p)}) {
        exact(0) += part / share;
        exact(1) += part;
      }
      exact(2) += V[p];
    });
  }

  /// Mass, momentum and kinetic energy of grains or liquid; returns the square of their speed.
  double add_phase(Local p, double m, Column velocity) {
    double square = 0;
    for (int d = 0; d < Dim; ++d) {
      const double v = particles_.row(velocity, d)[p];
      exact(static_cast<std::size_t>(3 + d)) += m * counted_.x(d, p);
      exact(static_cast<std::size_t>(3 + Dim + d)) += m * v;
      square += v * v;
    }
    exact(0) += m;
    exact(2) += 0.5 * m * square;
    return square;
  }

  void particles() {
    const double *mass = particles_.row(Column::mass), *V = particles_.row(Column::volume);
    for_counted([&](Local p) {
      const double square = add_phase(p, mass[p], Column::v);
      if (const double liquid = counted_.liquid_mass(p); liquid > 0)
        add_phase(p, liquid, Column::liquid_v);
      exact(1) += V[p];
      ++all_.added[open_.slots.added];
      least(0, -std::sqrt(square));
    });
  }

  /// A particle is in one place: sums over all are its bits.
  void track() {
    const auto width = open_.slots.n_added / std::max<std::size_t>(gauge_.ids.size(), 1);
    for_counted([&](Local p) {
      const auto found = std::lower_bound(gauge_.ids.begin(), gauge_.ids.end(),
                                          particles_.id[static_cast<std::size_t>(p)]);
      Index* to = &all_.added[open_.slots.added +
                              static_cast<std::size_t>(found - gauge_.ids.begin()) * width];
      *to++ += 1;
      const ParticleBin alone{
          .cell = -1, .begin = p, .end = p + 1, .limit = p + 1, .material = 0, .loaded = false};
      for (const ShownColumn<Dim>& field : open_.fields) {
        std::vector<double> values(static_cast<std::size_t>(field.components()));
        field.get({&particles_, {&alone, 1}}, values.data());
        for (const double value : values) *to++ += std::bit_cast<Index>(value);
      }
    });
  }

  const OpenGauge<Dim>& open_;
  const Gauge& gauge_;
  const Patch<Dim>& patch_;
  const ParticleBlock<Dim>& block_;
  const Model<Dim>& model_;
  double time_;  ///< [s]
  const Particles<Dim>& particles_;
  Counted<Dim> counted_;
  GaugeSums& all_;
};

/// How many numbers a gauge has.
template <int Dim>
void count_slots(OpenGauge<Dim>& open) {
  const Gauge& gauge = *open.gauge;
  GaugeSlots& slots = open.slots;
  switch (gauge.kind) {
    case Kind::columns:
      slots.n_least = gauge.places.size();
      [[fallthrough]];
    case Kind::points:
      slots.n_exact = gauge.places.size() * open.sums_of_place();
      break;
    case Kind::front:
      slots.n_least = 2;
      break;
    case Kind::plane:
      slots.n_exact = 3;
      break;
    case Kind::force:
      slots.n_exact = 6;
      break;
    case Kind::particles:
      slots.n_exact = 3 + 2 * Dim;
      slots.n_added = slots.n_least = 1;
      break;
    case Kind::track:
      slots.n_added = gauge.ids.size() * static_cast<std::size_t>(1 + open.field_components());
      break;
  }
}

}  // namespace

template <int Dim>
std::vector<OpenGauge<Dim>> open_gauges(const std::vector<Gauge>& gauges,
                                        const ColumnLayout<Dim>& layout, const Model<Dim>& model) {
  std::vector<OpenGauge<Dim>> opened;
  GaugeSlots next;
  std::size_t planes = 0, forces = 0;
  for (const Gauge& gauge : gauges) {
    OpenGauge<Dim> open{.gauge = &gauge, .fields = {}, .slots = next};
    if (gauge.kind == Kind::plane) open.number = planes++;
    if (gauge.kind == Kind::force) open.number = forces++;
    std::vector<std::string> names = gauge.fields;
    if (gauge.kind == Kind::track) names.insert(names.begin(), "coordinates");
    for (const std::string& name : names) {
      const auto field = shown_column<Dim>(name, layout, model);
      if (!field) {
        Problem problem;
        problem.message =
            fmt::format("gauge {}: particles of this case have no {}", gauge.name, name);
        throw InputError({problem});
      }
      open.fields.push_back(*field);
    }
    count_slots(open);
    next.exact += open.slots.n_exact;
    next.added += open.slots.n_added;
    next.least += open.slots.n_least;
    opened.push_back(std::move(open));
  }
  return opened;
}

template <int Dim>
bool has_passed(const Gauge& plane, const RemovedParticle& particle, const Model<Dim>& model) {
  if (plane.material >= 0 &&
      static_cast<int>(model.materials[static_cast<std::size_t>(particle.material)].id) !=
          plane.material)
    return false;
  if (plane.of_set && !std::binary_search(plane.ids.begin(), plane.ids.end(), particle.id))
    return false;
  double along = 0;
  for (std::size_t d = 0; d < 3; ++d)
    along += (particle.position[d] - plane.origin[d]) * plane.direction[d];
  return along > 0;
}

template <int Dim>
void add_to_gauge(const OpenGauge<Dim>& gauge, Patch<Dim>& patch, const Model<Dim>& model,
                  double time, GaugeSums& all) {
  if (gauge.gauge->kind != Kind::force) {
    for (const ParticleBlock<Dim>& block : blocks_of(patch))
      GaugeAdder<Dim>(gauge, patch, block, model, time, all).add();
    return;
  }
  if (patch.impulses.empty()) return;  // nothing has been here
  const Reaction impulse = std::exchange(patch.impulses[gauge.number], {});
  for (std::size_t d = 0; d < 3; ++d) {
    all.exact[gauge.slots.exact + d] += impulse.force[d];
    all.exact[gauge.slots.exact + 3 + d] += impulse.torque[d];
  }
}

template std::vector<OpenGauge<2>> open_gauges<2>(const std::vector<Gauge>&, const ColumnLayout<2>&,
                                                  const Model<2>&);
template std::vector<OpenGauge<3>> open_gauges<3>(const std::vector<Gauge>&, const ColumnLayout<3>&,
                                                  const Model<3>&);
template bool has_passed<2>(const Gauge&, const RemovedParticle&, const Model<2>&);
template bool has_passed<3>(const Gauge&, const RemovedParticle&, const Model<3>&);
template void add_to_gauge<2>(const OpenGauge<2>&, Patch<2>&, const Model<2>&, double, GaugeSums&);
template void add_to_gauge<3>(const OpenGauge<3>&, Patch<3>&, const Model<3>&, double, GaugeSums&);

}  // namespace lahar
