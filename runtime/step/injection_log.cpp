#include "runtime/step/injection_log.h"

#include <algorithm>
#include <bit>

namespace lahar {

namespace {

/// Events in an element of a sum: the sign stays out of it.
constexpr Index bits = 63;

}  // namespace

bool InjectionLog::due(double time) const {
  return std::any_of(generators_.begin(), generators_.end(),
                     [=](const Generator& g) { return g.start <= time && time < g.end; });
}

std::size_t InjectionLog::n_elements() const {
  return static_cast<std::size_t>((counts_.events + bits - 1) / bits);
}

std::vector<Index> InjectionLog::elements(std::span<const Index> events) const {
  std::vector<Index> all(n_elements(), 0);
  for (const Index event : events)
    all[static_cast<std::size_t>(event / bits)] |= Index{1} << event % bits;
  return all;
}

void InjectionLog::take(Index step, std::span<const Index> elements) {
  auto generator = generators_.begin();
  Index end = 0;  // of the generator's events
  if (generator != generators_.end()) end = generator->cells;
  for (std::size_t k = 0; k < elements.size(); ++k)
    for (auto rest = static_cast<std::uint64_t>(elements[k]); rest != 0; rest &= rest - 1) {
      const Index event = static_cast<Index>(k) * bits + std::countr_zero(rest);
      while (event >= end) end += (++generator)->cells;
      known_.push_back({counts_.id(step, event, 0), next_id_});
      next_id_ += generator->per_cell;
      generator->come += generator->per_cell;
    }
}

Index InjectionLog::dense(Index id) const {
  if (id < first_injected_id) return id;
  const auto after = std::upper_bound(known_.begin(), known_.end(), id,
                                      [](Index i, const Known& k) { return i < k.first; });
  // In a run that failed, particles may come from steps that were never finished.
  if (after == known_.begin()) return id;
  const Known& of = *(after - 1);
  return id - of.first < counts_.points ? of.dense + (id - of.first) : id;
}

void InjectionLog::make_dense(std::span<Index> ids) const {
  if (known_.empty()) return;
  for (Index& id : ids) id = dense(id);
}

}  // namespace lahar
