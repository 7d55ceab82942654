/// \file Particles of several bins side by side: laws that take long get full packs.
#pragma once

#include <utility>
#include <vector>

#include "physics/kernels/stress_update.h"

namespace lahar {

/// True of laws for which moving particles together and back takes less time than it saves.
template <class LawType>
concept TakesLong = requires {
  requires LawType::takes_long;
};

/// Whether packs of these bins become fewer by a quarter if nothing lies between bins.
template <class Real>
bool packing_pays(ParticleBins bins) {
  Local particles = 0, packs = 0;
  for (const ParticleBin& bin : bins) {
    particles += bin.end - bin.begin;
    packs += (bin.end - bin.begin + lanes<Real> - 1) / lanes<Real>;
  }
  return 4 * ((particles + lanes<Real> - 1) / lanes<Real>) <= 3 * packs;
}

/// Copies of what an update of stresses takes and gives, without room between bins.
template <int Dim, class Real>
class PackedBins {
 public:
  /// The bins from .. to of `bins`, which `gradients` belong to.
  PackedBins(ParticleBins bins, std::size_t from, std::size_t to, const Rows<Dim>& rows,
             const VelocityGradients<Dim>& gradients)
      : bins_(bins),
        from_(from),
        to_(to),
        first_(gradients.first),
        rows_(rows),
        memory_(of_thread()) {
    for (std::size_t r = from; r < to; ++r) size_ += bins[r].end - bins[r].begin;
    const auto room = static_cast<std::size_t>(size_ + lanes<Real>);
    std::size_t count = 0;
    rows_.each([&](double*&) { ++count; });
    for (NodeArray* array : {&memory_.most_opening, &memory_.work, &memory_.gradients.trace})
      grow(*array, room);
    for (NodeArray& row : memory_.gradients.L) grow(row, room);
    grow(memory_.rows, count * room);
    double* copy = memory_.rows.data();
    memory_.copies.clear();
    rows_.each([&](double*& row) {
      gather(row, copy, [](std::size_t, const ParticleBin& bin) { return bin.begin; });
      memory_.copies.push_back({row, copy});
      row = copy;
      copy += room;
    });
    const auto of_gradients = [&](std::size_t r, const ParticleBin&) { return first_[r]; };
    for (std::size_t k = 0; k < gradients.L.size(); ++k)
      gather(gradients.L[k].data(), memory_.gradients.L[k].data(), of_gradients);
    gather(gradients.trace.data(), memory_.gradients.trace.data(), of_gradients);
  }

  const Rows<Dim>& rows() const { return rows_; }
  StoredGradient<Dim> gradient() const { return {memory_.gradients, 0, 0}; }

  /// Before most_opening() is asked for.
  void find_most_opening(const Patch<Dim>& patch) {
    each_pack([&, last = to_, density = 0.0](std::size_t r, const ParticleBin& bin, Local i,
                                             Local to) mutable {
      if (r != last) last = r, density = density_around(patch, bin);
      store(lahar::most_opening<Dim, Real>(patch, density, bin.begin + i),
            memory_.most_opening.data() + to);
    });
  }

  // What stress.cpp asks of some particles.
  Local begin() const { return 0; }
  Local end() const { return size_; }
  LAHAR_INLINE Real most_opening(Local p) const {
    return load<Real>(memory_.most_opening.data() + p);
  }
  LAHAR_INLINE void add(const Real& work, Local p, Local n) {
    store_first(work, memory_.work.data() + p, n);
  }
  void record(Patch<Dim>& patch, Local p, const Failures& failures, const Real* before) const {
    Local at = 0;
    for (std::size_t r = from_; r < to_; ++r) {
      const ParticleBin& bin = bins_[r];
      const Local n = bin.end - bin.begin;
      unsigned here = 0;
      for (int lane = 0; lane < lanes<Real>; ++lane)
        if (p + lane >= at && p + lane < at + n) here |= 1u << lane;
      const Failures of_bin{failures.failed & here, failures.divided & here};
      if (of_bin.failed | of_bin.divided)
        record_failures(patch, bin, bin.begin + (p - at), of_bin, before);
      at += n;
    }
  }

  /// Bring the rows back, and the work to where the particles' gradients are in `work`.
  void finish(double* work) const {
    for (const auto& [row, copy] : memory_.copies)
      each_pack([row = row, copy = copy](std::size_t, const ParticleBin& bin, Local i, Local to) {
        store_first(load<Real>(copy + to), row + bin.begin + i, bin.end - bin.begin - i);
      });
    each_pack([&](std::size_t r, const ParticleBin&, Local i, Local to) {
      store(load<Real>(memory_.work.data() + to), work + first_[r] + i);
    });
  }

 private:
  /// Of all patches of a thread: it stays in its cache.
  struct Memory {
    NodeArray rows, most_opening, work;
    VelocityGradients<Dim> gradients;
    std::vector<std::pair<double*, const double*>> copies;  ///< rows, and where they are here
  };
  static Memory& of_thread() {
    static thread_local Memory memory;
    return memory;
  }
  static void grow(NodeArray& array, std::size_t size) {
    if (array.size() < size) array.resize(size);
  }
  /// `visit(position, bin, i, to)`: a pack that begins with the bin's particle i is at `to` here.
  template <class Visit>
  LAHAR_INLINE void each_pack(Visit visit) const {
    Local at = 0;
    for (std::size_t r = from_; r < to_; ++r) {
      const ParticleBin& bin = bins_[r];
      const Local n = bin.end - bin.begin;
      for (Local i = 0; i < n; i += lanes<Real>) visit(r, bin, i, at + i);
      at += n;
    }
  }
  /// Whole packs: what is beyond a bin's end is where the next bin comes.
  template <class Begin>
  void gather(const double* row, double* to_row, Begin begin) const {
    each_pack([&](std::size_t r, const ParticleBin& bin, Local i, Local to) {
      store(load<Real>(row + begin(r, bin) + i), to_row + to);
    });
  }

  ParticleBins bins_;
  std::size_t from_, to_;
  const std::vector<Local>& first_;
  Rows<Dim> rows_;  // the copies
  Memory& memory_;
  Local size_ = 0;
};

}  // namespace lahar
