#include "runtime/step/gauges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#include "physics/materials/pore_liquid.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

using Kind = Gauge::Kind;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr Index nothing = std::numeric_limits<Index>::max();  ///< of what the least counts

/// Names of the components of a vector or tensor: velocity_x, stress_xx.
void add_columns(std::vector<GaugeColumn>& columns, const FrameColumn& field,
                 const std::string& meaning) {
  const auto names = component_names(field.components);
  for (int c = 0; c < field.components; ++c) {
    const std::string suffix = field.components == 1 ? ""
                               : names.empty()
                                   ? "_" + std::to_string(c)
                                   : std::string("_") + names[static_cast<std::size_t>(c)];
    columns.push_back({field.name + suffix, field.unit, meaning});
  }
}

void add_axes(std::vector<GaugeColumn>& columns, const char* name, const char* unit, int axes,
              const char* meaning) {
  for (int d = 0; d < axes; ++d) columns.push_back({std::string(name) + "xyz"[d], unit, meaning});
}

/// Where places are; a gauge of one place need not say it.
void add_place_columns(std::vector<GaugeColumn>& columns, const Gauge& gauge, int axes) {
  if (gauge.places.size() == 1) return;
  columns.push_back({"distance", "m", "from the first place"});
  add_axes(columns, "", "m", axes, "the place");
}

template <int Dim>
GaugeTable table_of(const OpenGauge<Dim>& open) {
  const Gauge& gauge = *open.gauge;
  GaugeTable table{gauge.name, {}};
  auto& columns = table.columns;
  switch (gauge.kind) {
    case Kind::points:
      add_place_columns(columns, gauge, Dim);
      for (const auto& field : open.fields)
        add_columns(columns, field.header(), "mean of the particles around the place");
      break;
    case Kind::columns:
      add_place_columns(columns, gauge, Dim - 1);
      columns.push_back({"thickness", "m", "volume over area"});
      columns.push_back({"height", "m", "of the upper side of the highest particle"});
      add_axes(columns, "velocity_", "m/s", Dim, "mean by volume");
      break;
    case Kind::front:
      columns.push_back({"front", "m", "largest position along the direction"});
      columns.push_back({"rear", "m", "least position along the direction"});
      break;
    case Kind::plane:
      columns.push_back({"mass_beyond", "kg", "mass of the particles beyond the plane"});
      columns.push_back({"volume_beyond", "m^3", "volume of the particles beyond the plane"});
      columns.push_back({"mass_passed", "kg", "since the start; that back counts against it"});
      columns.push_back({"mass_flow", "kg/s", "mean since the row before"});
      break;
    case Kind::force:
      add_axes(columns, "force_", "N", Dim,
               "mean since the row before, of material on what it meets");
      if (Dim == 3)
        add_axes(columns, "moment_", "N m", Dim, "likewise");
      else
        columns.push_back({"moment_z", "N m", "likewise"});
      break;
    case Kind::particles:
      columns.push_back({"particles", "-", "their number"});
      columns.push_back({"mass", "kg", "their mass"});
      columns.push_back({"volume", "m^3", "their volume"});
      add_axes(columns, "centre_", "m", Dim, "centre of mass");
      add_axes(columns, "velocity_", "m/s", Dim, "mean by mass");
      columns.push_back({"kinetic", "J", "kinetic energy"});
      columns.push_back({"potential", "J", "of weight, 0 at the origin of coordinates"});
      columns.push_back({"max_speed", "m/s", "of the fastest particle"});
      break;
    case Kind::track:
      columns.push_back({"id", "-", "particle"});
      for (const auto& field : open.fields) {
        FrameColumn header = field.header();
        if (header.name == "coordinates")
          add_axes(columns, "", "m", Dim, "its place");
        else
          add_columns(columns, header, "its value");
      }
      break;
  }
  return table;
}

/// The exact sums in a span of their elements.
void read_exact(std::span<const Index> elements, std::vector<ExactSum>& sums) {
  for (std::size_t k = 0; k < sums.size(); ++k)
    sums[k] = ExactSum(elements.subspan(k * ExactSum::size).first<ExactSum::size>());
}

void append_sums(std::vector<Index>& to, const std::vector<ExactSum>& sums) {
  for (const ExactSum& sum : sums)
    to.insert(to.end(), sum.elements().begin(), sum.elements().end());
}

}  // namespace

template <int Dim>
Gauges<Dim>::Gauges(const Model<Dim>& model, const ColumnLayout<Dim>& layout)
    : model_(model),
      plan_(model.output.measured),
      gauges_(open_gauges<Dim>(plan_.gauges, layout, model)) {
  std::size_t planes = 0;
  for (const auto& open : gauges_) {
    size_.n_exact += open.slots.n_exact;
    size_.n_added += open.slots.n_added;
    size_.n_least += open.slots.n_least;
    planes += open.gauge->kind == Kind::plane;
  }
  state_.beyond.assign(2 * planes, nan);
  state_.removed.assign(planes * ExactSum::size, 0);
  if (plan_.maps.wanted) state_.maps = empty_maps(plan_.maps);
}

template <int Dim>
std::vector<GaugeTable> Gauges<Dim>::tables() const {
  std::vector<GaugeTable> tables;
  for (const auto& open : gauges_) tables.push_back(table_of(open));
  return tables;
}

template <int Dim>
std::size_t Gauges<Dim>::n_sums() const {
  const auto cells = static_cast<std::size_t>(plan_.maps.wanted ? plan_.maps.cells() : 0);
  return size_.n_exact * ExactSum::size + size_.n_added + cells * MapSums::n_added;
}

template <int Dim>
std::size_t Gauges<Dim>::n_least() const {
  return size_.n_least + static_cast<std::size_t>(plan_.maps.wanted ? plan_.maps.cells() : 0);
}

template <int Dim>
GaugeSums Gauges<Dim>::room() const {
  return {std::vector<ExactSum>(size_.n_exact), std::vector<Index>(size_.n_added, 0),
          std::vector<Index>(size_.n_least, nothing)};
}

template <int Dim>
void Gauges<Dim>::add_to(Found& found, Patch<Dim>& patch, double time) const {
  bool exists = false;
  GaugeSums& own = found.of_threads.local(exists);
  if (!exists) own = room();
  for (const OpenGauge<Dim>& open : gauges_) {
    add_to_gauge(open, patch, model_, time, own);
    if (open.gauge->kind != Kind::plane) continue;
    for (const RemovedParticle& one : patch.removed)
      if (has_passed(*open.gauge, one, model_))
        for (const double mass : {one.mass, one.liquid_mass}) own.exact[open.slots.exact] += mass;
  }
  if constexpr (Dim == 3) {
    if (!plan_.maps.wanted) return;
    const std::vector<MapTerm> terms = map_terms(patch, plan_.maps);
    const std::lock_guard lock(found.maps_mutex);
    const auto cells = static_cast<std::size_t>(plan_.maps.cells());
    if (found.maps.least.empty()) {
      found.maps.added.assign(cells * MapSums::n_added, 0);
      found.maps.least.assign(cells, nothing);
    }
    for (const MapTerm& term : terms) lahar::add_to(found.maps, term);
  }
}

template <int Dim>
void Gauges<Dim>::gather(Found& found, std::vector<Index>& sum, std::vector<Index>& least) const {
  GaugeSums all = room();
  for (const GaugeSums& own : found.of_threads) {
    for (std::size_t k = 0; k < all.exact.size(); ++k) all.exact[k] += own.exact[k];
    for (std::size_t k = 0; k < all.added.size(); ++k) all.added[k] += own.added[k];
    for (std::size_t k = 0; k < all.least.size(); ++k)
      all.least[k] = std::min(all.least[k], own.least[k]);
  }
  found.of_threads.clear();
  append_sums(sum, all.exact);
  sum.insert(sum.end(), all.added.begin(), all.added.end());
  least.insert(least.end(), all.least.begin(), all.least.end());
  if (!plan_.maps.wanted) return;
  const auto cells = static_cast<std::size_t>(plan_.maps.cells());
  found.maps.added.resize(cells * MapSums::n_added, 0);  // without patches it is empty
  found.maps.least.resize(cells, nothing);
  sum.insert(sum.end(), found.maps.added.begin(), found.maps.added.end());
  least.insert(least.end(), found.maps.least.begin(), found.maps.least.end());
  found.maps = {};
}

template <int Dim>
void Gauges<Dim>::add(Patch<Dim>& patch, Step step, double time) {
  add_to(found_[step], patch, time);
}

template <int Dim>
void Gauges<Dim>::give(Step step, Agreement& own) {
  gather(found_[step], own.sum, own.lowest);
}

template <int Dim>
GaugeRows Gauges<Dim>::present(std::span<Patch<Dim>* const> patches, Step at, double time,
                               const Communicator& ranks) {
  Found found;
  for (Patch<Dim>* patch : patches) add_to(found, *patch, time);
  std::vector<Index> sum, least;
  gather(found, sum, least);
  ranks.sum(sum);
  ranks.min(least);
  return take(at - 1, time, sum, least);
}

template <int Dim>
GaugeRows Gauges<Dim>::take(Step step, double time, std::span<const Index> sum,
                            std::span<const Index> least) {
  GaugeSums all = room();
  read_exact(sum, all.exact);
  sum = sum.subspan(size_.n_exact * ExactSum::size);
  std::copy_n(sum.begin(), size_.n_added, all.added.begin());
  std::copy_n(least.begin(), size_.n_least, all.least.begin());
  GaugeRows rows{.step = step + 1, .time = time, .values = {}};
  for (std::size_t k = 0; k < gauges_.size(); ++k) rows.values.push_back(values_of(k, all, time));
  if (plan_.maps.wanted)
    add_to_maps(state_.maps, plan_.maps, time, sum.subspan(size_.n_added),
                least.subspan(size_.n_least));
  state_.time = time;
  return rows;
}

template <int Dim>
std::vector<double> Gauges<Dim>::values_of(std::size_t k, const GaugeSums& all, double time) {
  const OpenGauge<Dim>& open = gauges_[k];
  const auto exact = [&](std::size_t i) { return all.exact[open.slots.exact + i].value(); };
  const auto least = [&](std::size_t i) {
    const Index found = all.least[open.slots.least + i];
    return found == nothing ? nan : ordered_value(found);
  };
  std::vector<double> row;
  switch (open.gauge->kind) {
    case Kind::points:
    case Kind::columns:
      add_places(open, all, row);
      break;
    case Kind::front:
      row = {-least(0), least(1)};
      break;
    case Kind::plane:
      row = plane_row(open, all, time);
      break;
    case Kind::force: {
      const double since = time - state_.time;
      const auto add = [&](std::size_t d) { row.push_back(since > 0 ? exact(d) / since : nan); };
      for (std::size_t d = 0; d < Dim; ++d) add(d);
      for (std::size_t d = Dim == 3 ? 3 : 5; d < 6; ++d) add(d);  // in the plane, about z alone
      break;
    }
    case Kind::particles: {
      const double mass = exact(0);
      row = {static_cast<double>(all.added[open.slots.added]), mass, exact(1)};
      for (std::size_t d = 0; d < 2 * Dim; ++d) row.push_back(exact(3 + d) / mass);
      const double ramp = load_factor(model_, model_.gravity_function, time);
      double potential = 0;
      for (int d = 0; d < Dim; ++d)
        potential -= ramp * model_.gravity[d] * exact(static_cast<std::size_t>(3 + d));
      row.insert(row.end(), {exact(2), potential, -least(0)});
      break;
    }
    case Kind::track:
      add_tracks(open, all, row);
      break;
  }
  return row;
}

/// The integral of the weights around a place over the mesh in plan: there is nothing beyond it.
template <int Dim>
double Gauges<Dim>::area_of_weights(const std::array<double, 3>& place,
                                    const std::array<double, 3>& radii) const {
  const auto [low, high] = model_.mesh->bounds();
  double area = 1;
  for (int d = 0; d + 1 < Dim; ++d) {
    // Of 1 - |t| from the place to the distance t, as a multiple of the radius.
    const auto integral = [](double t) {
      t = std::clamp(t, -1.0, 1.0);
      return t * (1 - 0.5 * std::abs(t));
    };
    const double x = place[static_cast<std::size_t>(d)],
                 radius = radii[static_cast<std::size_t>(d)];
    area *= radius * (integral((high[d] - x) / radius) - integral((low[d] - x) / radius));
  }
  return area;
}

template <int Dim>
void Gauges<Dim>::add_places(const OpenGauge<Dim>& open, const GaugeSums& all,
                             std::vector<double>& row) const {
  const Gauge& gauge = *open.gauge;
  const bool in_plan = gauge.kind == Kind::columns;
  const int axes = in_plan ? Dim - 1 : Dim;
  const std::size_t width = open.sums_of_place();
  for (std::size_t k = 0; k < gauge.places.size(); ++k) {
    const auto& place = gauge.places[k];
    if (gauge.places.size() > 1) {
      double square = 0;
      for (std::size_t d = 0; d < 3; ++d)
        square += (place[d] - gauge.places[0][d]) * (place[d] - gauge.places[0][d]);
      row.push_back(std::sqrt(square));
      row.insert(row.end(), place.begin(), place.begin() + axes);
    }
    const ExactSum* sums = &all.exact[open.slots.exact + k * width];
    const double weight = sums[0].value();
    if (in_plan) {
      row.push_back(weight / area_of_weights(place, gauge.radius));
      const Index highest = all.least[open.slots.least + k];
      row.push_back(highest == nothing ? nan : -ordered_value(highest));
    }
    for (std::size_t c = 1; c < width; ++c)
      row.push_back(weight > 0 ? sums[c].value() / weight : nan);
  }
}

template <int Dim>
void Gauges<Dim>::add_tracks(const OpenGauge<Dim>& open, const GaugeSums& all,
                             std::vector<double>& row) const {
  const Gauge& gauge = *open.gauge;
  const auto width = static_cast<std::size_t>(open.field_components());
  const Index* from = all.added.data() + open.slots.added;
  for (const Index id : gauge.ids) {
    const bool is_there = *from++ == 1;
    if (is_there) {
      row.push_back(static_cast<double>(id));
      for (std::size_t c = 0; c < width; ++c) row.push_back(std::bit_cast<double>(from[c]));
    }
    from += width;
  }
}

template <int Dim>
std::vector<double> Gauges<Dim>::plane_row(const OpenGauge<Dim>& open, const GaugeSums& all,
                                           double time) {
  double &at_start = state_.beyond[2 * open.number],
         &passed_before = state_.beyond[2 * open.number + 1];
  // Particles that left beyond the plane have passed it, those that came in there have not. Those
  // that patches list as removed are in the sum.
  ExactSum beyond_or_gone = removed_beyond(open.number);
  beyond_or_gone += all.exact[open.slots.exact];
  const double passed_or_there = beyond_or_gone.value();
  if (std::isnan(at_start)) {
    at_start = passed_or_there;
    passed_before = 0;
  }
  const double passed = passed_or_there - at_start;
  const double flow = time > state_.time ? (passed - passed_before) / (time - state_.time) : 0.0;
  passed_before = passed;
  return {all.exact[open.slots.exact + 1].value(), all.exact[open.slots.exact + 2].value(), passed,
          flow};
}

template <int Dim>
ExactSum Gauges<Dim>::removed_beyond(std::size_t plane) const {
  return ExactSum(std::span<const Index>(state_.removed)
                      .subspan(plane * ExactSum::size)
                      .first<ExactSum::size>());
}

template <int Dim>
void Gauges<Dim>::set_removed_beyond(std::size_t plane, const ExactSum& sum) {
  std::copy(sum.elements().begin(), sum.elements().end(),
            state_.removed.begin() + static_cast<std::ptrdiff_t>(plane * ExactSum::size));
}

template <int Dim>
void Gauges<Dim>::add_removed(std::span<const RemovedParticle> particles) {
  for (const auto& open : gauges_) {
    if (open.gauge->kind != Kind::plane) continue;
    ExactSum sum = removed_beyond(open.number);
    for (const RemovedParticle& one : particles)
      if (has_passed(*open.gauge, one, model_))
        for (const double mass : {one.mass, one.liquid_mass}) sum += mass;
    set_removed_beyond(open.number, sum);
  }
}

template <int Dim>
void Gauges<Dim>::add_injected(const Patch<Dim>& patch, std::span<const Index> events,
                               std::vector<ExactSum>& beyond) const {
  for (const Index event : events) {
    const auto at = std::lower_bound(patch.injection_cells.begin(), patch.injection_cells.end(),
                                     event, [](const auto& a, Index e) { return a.event < e; });
    const Injection<Dim>& source = model_.injections[at->generator];
    const Material& material = model_.materials[source.material];
    RemovedParticle one;  // as one that is taken away again
    one.id = first_injected_id;
    one.material = source.material;
    for (std::size_t i = 0; i < static_cast<std::size_t>(source.per_cell); ++i) {
      const Vec<Dim>& x = patch.injection_points[at->first_point + i];
      std::copy_n(x.data(), Dim, one.position.begin());
      const double volume = at->volume * depth_at(model_.analysis, x[0]);
      const double mass = volume * material.density;
      const double liquid = liquid_mass_of(material.liquid, mass, volume);
      for (const auto& open : gauges_)
        if (open.gauge->kind == Kind::plane && has_passed(*open.gauge, one, model_))
          for (const double part : {mass, liquid}) beyond[open.number] += part;
    }
  }
}

template <int Dim>
void Gauges<Dim>::take_injected(std::span<const Index> beyond) {
  std::vector<ExactSum> sums(n_planes());
  read_exact(beyond, sums);
  for (std::size_t plane = 0; plane < sums.size(); ++plane) {
    // Against what has left there: exactly, element by element.
    std::array<Index, ExactSum::size> less;
    std::transform(sums[plane].elements().begin(), sums[plane].elements().end(), less.begin(),
                   std::negate<Index>());
    ExactSum sum = removed_beyond(plane);
    sum += ExactSum(less);
    set_removed_beyond(plane, sum);
  }
}

template <int Dim>
void Gauges<Dim>::resume(const GaugeState& state) {
  state_.time = state.time;
  if (state.beyond.size() == state_.beyond.size() &&
      state.removed.size() == state_.removed.size()) {
    state_.beyond = state.beyond;
    state_.removed = state.removed;
  }
  if (state.maps.size() == state_.maps.size()) state_.maps = state.maps;
}

template class Gauges<2>;
template class Gauges<3>;

}  // namespace lahar
