/// \file What frames and gauges show of particles: columns, state variables and derived fields.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "io/frames/frame.h"
#include "physics/materials/law.h"
#include "physics/particles/derived_fields.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Particles of a patch: some of its bins, or all of an outbox.
template <int Dim>
struct ParticleBlock {
  const Particles<Dim>* particles;
  std::span<const ParticleBin> bins = {};
  bool whole = false;  ///< all particles, without bins

  /// Call body(begin, end) with slots that follow each other.
  void for_each_range(auto&& body) const {
    if (whole) body(Local{0}, particles->size());
    for (const ParticleBin& bin : bins) body(bin.begin, bin.end);
  }
};

/// All particles that a patch holds, those on their way to a neighbour included.
template <int Dim>
std::vector<ParticleBlock<Dim>> blocks_of(const Patch<Dim>& patch);

/// A quantity of particles with a name; one of the three that constructors take.
template <int Dim>
class ShownColumn {
 public:
  /// A column; strain is shown even where it is not stored.
  ShownColumn(const ColumnInfo& info, const ColumnLayout<Dim>& layout, const Model<Dim>& model);
  ShownColumn(const DerivedField& field, const Model<Dim>& model);
  /// A state variable, as a field of its own.
  ShownColumn(const StateVariable& variable, const Model<Dim>& model);

  int components() const { return tensor_ ? 6 : stored_; }
  FrameColumn header() const;  ///< without values
  /// The components of a block's particles, particle after particle; `to` is zero before.
  void get(const ParticleBlock<Dim>& block, double* to) const;

 private:
  double state_variable(const Particles<Dim>& particles, Local p) const;
  void derive_strain(const Particles<Dim>& particles, Local p, double* to) const;
  ParticleValues values_of(const Particles<Dim>& particles, Local p) const;

  const Model<Dim>* model_;
  int stored_;
  // One of these three says what it is.
  const ColumnInfo* info_ = nullptr;
  const StateVariable* variable_ = nullptr;
  const DerivedField* field_ = nullptr;
  bool tensor_ = false, strain_of_stress_ = false;
  std::vector<int> component_;  ///< of the variable, by material; -1 = has none
};

/// The columns of a frame: coordinates first, then the others, and what follows from them.
template <int Dim>
std::vector<ShownColumn<Dim>> shown_columns(const ColumnLayout<Dim>& layout,
                                            const Model<Dim>& model);

/// The column, state variable or derived field of a name; none where the model has none.
template <int Dim>
std::optional<ShownColumn<Dim>> shown_column(std::string_view name, const ColumnLayout<Dim>& layout,
                                             const Model<Dim>& model);

}  // namespace lahar
