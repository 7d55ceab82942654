#include "runtime/step/map_sums.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/base/simd.h"
#include "runtime/step/gauge_sums.h"

namespace lahar {

namespace {

constexpr double most_speed = 16384;  ///< [m/s]
constexpr double most = 0x1p60;

/// [m^3] that `most` units are.
double full_volume(const MapPlan& plan) {
  return 2 * plan.height * plan.cell * plan.cell;
}

/// As llround(), without a call.
Index rounded(double share) {
  const double units = std::clamp(share, -1.0, 1.0) * most;
  const auto whole = static_cast<Index>(units);  // towards zero
  const double rest = units - static_cast<double>(whole);
  return whole + (rest >= 0.5) - (rest <= -0.5);
}

/// Particles of a patch, by raster cell.
class TermsOfPatch {
 public:
  explicit TermsOfPatch(const MapPlan& plan) : plan_(plan), full_(full_volume(plan)) {}

  void add(const ParticleBlock<3>& block) {
    const Particles<3>& particles = *block.particles;
    const auto x = particles.rows<3>(Column::x), v = particles.rows<3>(Column::v);
    const auto stress = particles.rows<3>(Column::stress);
    const double* V = particles.row(Column::volume);
    block.for_each_range([&](Local begin, Local end) {
      MapTerm term{.cell = -1};
      for (Local p = begin; p < end; ++p) {
        if (const Index cell = cell_at(x[0][p], x[1][p]); cell != term.cell) {
          add(term);
          term = {.cell = cell};
        }
        const double share = V[p] / full_;
        term.added[0] += rounded(share);
        LAHAR_UNROLL
        for (std::size_t d = 0; d < 3; ++d)
          term.added[1 + d] += rounded(share * (v[d][p] / most_speed));
        term.trace = std::min(term.trace, stress[0][p] + stress[1][p] + stress[2][p]);
      }
      add(term);
    });
  }
  std::vector<MapTerm> take() { return std::move(terms_); }

 private:
  /// -1 = beyond the raster.
  Index cell_at(double x, double y) const {
    const double i = std::floor((x - plan_.low[0]) / plan_.cell);
    const double j = std::floor((y - plan_.low[1]) / plan_.cell);
    const bool inside = i >= 0 && j >= 0 && i < static_cast<double>(plan_.n[0]) &&
                        j < static_cast<double>(plan_.n[1]);
    return inside ? static_cast<Index>(j) * plan_.n[0] + static_cast<Index>(i) : -1;
  }
  void add(const MapTerm& term) {
    if (term.cell < 0) return;
    if (terms_.empty() || terms_.back().cell != term.cell) {
      terms_.push_back(term);
      return;
    }
    MapTerm& last = terms_.back();
    for (std::size_t k = 0; k < MapSums::n_added; ++k) last.added[k] += term.added[k];
    last.trace = std::min(last.trace, term.trace);
  }

  const MapPlan& plan_;
  double full_;
  std::vector<MapTerm> terms_;
};

}  // namespace

std::vector<MapTerm> map_terms(const Patch<3>& patch, const MapPlan& plan) {
  TermsOfPatch terms(plan);
  for (const ParticleBlock<3>& block : blocks_of(patch)) terms.add(block);
  return terms.take();
}

void add_to(MapSums& sums, const MapTerm& term) {
  const auto cell = static_cast<std::size_t>(term.cell);
  for (std::size_t k = 0; k < MapSums::n_added; ++k)
    sums.added[cell * MapSums::n_added + k] += term.added[k];
  sums.least[cell] = std::min(sums.least[cell], ordered_bits(term.trace / 3));
}

std::vector<double> empty_maps(const MapPlan& plan) {
  const auto n = static_cast<std::size_t>(plan.cells());
  std::vector<double> maps(n_maps * n, 0.0);
  std::fill(maps.end() - static_cast<std::ptrdiff_t>(n), maps.end(),
            std::numeric_limits<double>::quiet_NaN());
  return maps;
}

void add_to_maps(std::vector<double>& maps, const MapPlan& plan, double time,
                 std::span<const Index> added, std::span<const Index> least) {
  const auto n = static_cast<std::size_t>(plan.cells());
  const auto map = [&](MapKind kind) { return maps.data() + static_cast<std::size_t>(kind) * n; };
  const double metres = full_volume(plan) / (plan.cell * plan.cell) / most;
  for (std::size_t k = 0; k < n; ++k) {
    const auto sums = added.subspan(MapSums::n_added * k).first<MapSums::n_added>();
    const double thickness = static_cast<double>(sums[0]) * metres;
    const bool counts = thickness > plan.threshold;
    map(MapKind::thickness)[k] = counts ? thickness : 0;
    map(MapKind::speed)[k] = map(MapKind::pressure)[k] = 0;
    if (!counts) continue;
    double square = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double v = static_cast<double>(sums[1 + d]) / static_cast<double>(sums[0]) * most_speed;
      square += v * v;
    }
    const auto raise = [&](MapKind kind, double value) {
      map(kind)[k] = std::max(map(kind)[k], value);
    };
    const double speed = std::sqrt(square), pressure = -ordered_value(least[k]);
    map(MapKind::speed)[k] = speed;
    map(MapKind::pressure)[k] = pressure;
    raise(MapKind::max_thickness, thickness);
    raise(MapKind::max_speed, speed);
    raise(MapKind::max_pressure, pressure);
    double& arrival = map(MapKind::arrival_time)[k];
    if (std::isnan(arrival)) arrival = time;
  }
}

}  // namespace lahar
