#include "runtime/step/snapshot.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "physics/materials/law.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

/// Voigt components of a column's stored components: 2D stress xx yy zz xy, 2D strain xx yy xy.
template <int Dim>
int voigt(Column column, int component) {
  if (Dim == 2 && column == Column::strain && component == 2) return 3;
  return component;
}

/// Particles in a block: those of a patch in its bins, those of an outbox all.
template <int Dim>
struct Block {
  const Particles<Dim>* particles;
  const std::vector<ParticleBin>* bins = nullptr;

  /// Call body(begin, end) with slots that follow each other.
  void for_each_range(auto&& body) const {
    if (bins == nullptr) {
      body(Local{0}, particles->size());
      return;
    }
    for (const ParticleBin& bin : *bins) body(bin.begin, bin.end);
  }
};

/// All particles that a patch holds.
template <int Dim>
std::vector<Block<Dim>> blocks_of(const Patch<Dim>& patch) {
  std::vector<Block<Dim>> blocks{{&patch.particles, &patch.bins}};
  for (const auto& out : patch.outbox)
    if (out.particles.size() > 0) blocks.push_back({&out.particles});
  return blocks;
}

/// What frames show of a column.
template <int Dim>
class Shown {
 public:
  Shown(const ColumnInfo& info, const ColumnLayout<Dim>& layout, const Model<Dim>& model)
      : model_(&model),
        stored_(layout.components(info)),
        info_(&info),
        tensor_(info.column == Column::stress || info.column == Column::strain),
        strain_of_stress_(!layout.has(info.column)) {}

  Shown(const DerivedField& field, const Model<Dim>& model)
      : model_(&model), stored_(field.components), field_(&field) {}

  /// A state variable, as a field of its own.
  Shown(const StateVariable& variable, const Model<Dim>& model)
      : model_(&model), stored_(1), variable_(&variable) {
    for (const Material& material : model.materials) {
      const auto all = state_variables(material.law);
      const auto found = std::find_if(
          all.begin(), all.end(), [&](const StateVariable& v) { return v.name == variable.name; });
      component_.push_back(found == all.end() ? -1 : static_cast<int>(found - all.begin()));
    }
  }

  /// Strain is shown even where it is not stored.
  static bool is_shown(const ColumnInfo& info, const ColumnLayout<Dim>& layout) {
    return info.exported && info.column != Column::state &&
           (layout.has(info.column) || info.column == Column::strain);
  }
  int components() const { return tensor_ ? 6 : stored_; }
  FrameColumn header() const {
    if (variable_) return {std::string(variable_->name), std::string(variable_->unit), 1, {}};
    if (field_)
      return {std::string(field_->name), std::string(field_->unit), field_->components, {}};
    return {info_->name, info_->unit, components(), {}};
  }
  /// The components of a block's particles, particle after particle; `to` is zero before.
  void get(const Block<Dim>& block, double* to) const {
    const Particles<Dim>& particles = *block.particles;
    const int width = components();
    block.for_each_range([&](Local begin, Local end) {
      if (variable_)
        for (Local p = begin; p < end; ++p) to[p - begin] = state_variable(particles, p);
      else if (field_)
        for (Local p = begin; p < end; ++p)
          field_->value(values_of(particles, p), to + (p - begin) * width);
      else if (strain_of_stress_)
        for (Local p = begin; p < end; ++p) derive_strain(particles, p, to + (p - begin) * width);
      else
        for (int c = 0; c < stored_; ++c) {
          const double* from = particles.row(info_->column, c);
          double* at = to + (tensor_ ? voigt<Dim>(info_->column, c) : c);
          for (Local p = begin; p < end; ++p, at += width) *at = from[p];
        }
      to += static_cast<std::ptrdiff_t>(end - begin) * width;
    });
  }

 private:
  /// 0 for particles whose material does not have it.
  [[gnu::noinline]] double state_variable(const Particles<Dim>& particles, Local p) const {
    const auto material = particles.material[static_cast<std::size_t>(p)];
    const int k = component_[material];
    if (k < 0) return 0;
    const Law& law = model_->materials[material].law;
    const auto variables = state_variables(law);
    if (!variables[static_cast<std::size_t>(k)].of_stress)
      return particles.row(Column::state, k)[p];
    Voigt stress{};
    for (int c = 0; c < stress_components<Dim>; ++c)
      stress[static_cast<std::size_t>(c)] = particles.row(Column::stress, c)[p];
    std::vector<double> values(variables.size());
    derive_state(law, stress, values.data());
    return values[static_cast<std::size_t>(k)];
  }

  /// Never inlined: in a loop compilers make vectors of some particles, and fuse products and sums
  /// there as they do not in what is left over. The last bit would depend on a particle's place.
  [[gnu::noinline]] void derive_strain(const Particles<Dim>& particles, Local p, double* to) const {
    const auto material = particles.material[static_cast<std::size_t>(p)];
    std::array<double, stress_components<Dim>> stress;
    for (std::size_t k = 0; k < stress.size(); ++k)
      stress[k] = particles.row(Column::stress, static_cast<int>(k))[p];
    const auto strain =
        strain_of<Dim>(std::get<LinearElastic>(model_->materials[material].law), stress);
    std::copy(strain.begin(), strain.end(), to);
  }

  ParticleValues values_of(const Particles<Dim>& particles, Local p) const {
    ParticleValues values;
    const auto take = [&](Column column, double* to) {
      for (int c = 0; c < particles.layout().components(column); ++c)
        to[voigt<Dim>(column, c)] = particles.row(column, c)[p];
    };
    take(Column::mass, &values.mass);
    take(Column::volume, &values.volume);
    take(Column::x, values.x.data());
    take(Column::v, values.v.data());
    take(Column::u, values.u.data());
    take(Column::stress, values.stress.data());
    if (particles.layout().has(Column::strain))
      take(Column::strain, values.strain.data());
    else
      derive_strain(particles, p, values.strain.data());
    const auto& liquid = model_->materials[particles.material[static_cast<std::size_t>(p)]].liquid;
    if (!liquid) return values;
    const Pores pores(*liquid);
    values.porosity = pores.porosity(Scalar(values.mass), Scalar(values.volume))[0];
    values.liquid_mass = pores.liquid_mass(Scalar(values.mass), Scalar(values.volume))[0];
    take(Column::pore_pressure, &values.pore_pressure);
    return values;
  }

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
std::vector<Shown<Dim>> shown_columns(const ColumnLayout<Dim>& layout, const Model<Dim>& model) {
  std::vector<Shown<Dim>> columns;
  for (const ColumnInfo& info : column_table)
    if (Shown<Dim>::is_shown(info, layout))
      columns.insert(info.column == Column::x ? columns.begin() : columns.end(),
                     Shown<Dim>(info, layout, model));
  if (layout.has(Column::state))
    for (const StateVariable* variable : state_variables(model.materials))
      columns.push_back(Shown<Dim>(*variable, model));
  for (const DerivedField* field : model.output.derived_fields)
    columns.push_back(Shown<Dim>(*field, model));
  return columns;
}

/// `all`: particles that the frame will have.
template <int Dim>
void append(Frame& frame, const Block<Dim>& block, Index all, const Model<Dim>& model) {
  const Particles<Dim>& particles = *block.particles;
  const std::size_t before = frame.id.size();
  block.for_each_range([&](Local begin, Local end) {
    for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
      frame.id.push_back(particles.id[p]);
      frame.material.push_back(
          static_cast<std::int32_t>(model.materials[particles.material[p]].id));
    }
  });
  const std::size_t n = frame.id.size() - before;
  const auto columns = shown_columns<Dim>(particles.layout(), model);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (k > frame.columns.size()) frame.columns.push_back(columns[k].header());
    auto& values = k == 0 ? frame.coordinates : frame.columns[k - 1].values;
    const auto width = static_cast<std::size_t>(columns[k].components());
    const std::size_t at = values.size();
    values.reserve(static_cast<std::size_t>(all) * width);
    values.resize(at + n * width);
    columns[k].get(block, values.data() + at);
  }
}

}  // namespace

template <int Dim>
Frame snapshot(const Patch<Dim>& patch, const Model<Dim>& model, Frame spare) {
  Frame frame = std::move(spare);
  frame.dim = Dim;
  const Index n = particles_of(patch);
  frame.id.reserve(static_cast<std::size_t>(n));
  frame.material.reserve(static_cast<std::size_t>(n));
  for (const Block<Dim>& block : blocks_of(patch)) append(frame, block, n, model);
  return frame;
}

template <int Dim>
Index particles_of(const Patch<Dim>& patch) {
  Index n = 0;
  for (const ParticleBin& bin : patch.bins) n += bin.end - bin.begin;
  for (const auto& out : patch.outbox) n += out.particles.size();
  return n;
}

template <int Dim>
FrameHeader frame_header(const ColumnLayout<Dim>& layout, const Model<Dim>& model) {
  FrameHeader header;
  header.dim = Dim;
  const auto columns = shown_columns<Dim>(layout, model);
  for (std::size_t k = 1; k < columns.size(); ++k) header.columns.push_back(columns[k].header());
  return header;
}

template <int Dim>
FrameSource frame_source(const std::vector<const Patch<Dim>*>& patches, FrameHeader header,
                         const Model<Dim>& model) {
  FrameSource frame;
  frame.header = std::move(header);
  for (const Patch<Dim>* patch : patches) frame.sizes.push_back(particles_of(*patch));
  frame.piece = [patches, &model](std::size_t i) { return snapshot(*patches[i], model); };
  return frame;
}

template <int Dim>
std::size_t frame_bytes(const ColumnLayout<Dim>& layout, const Model<Dim>& model, Index particles) {
  std::size_t bytes = sizeof(Index) + sizeof(std::int32_t);
  for (const auto& column : shown_columns<Dim>(layout, model))
    bytes += static_cast<std::size_t>(column.components()) * sizeof(double);
  return bytes * static_cast<std::size_t>(particles);
}

namespace {

template <int Dim>
void add_particles(HistoryRow& row, std::span<const ParticleBin> bins,
                   const Particles<Dim>& particles) {
  const double* m = particles.row(Column::mass);
  const auto v = particles.template rows<Dim>(Column::v);
  Pack mass(0.0), kinetic(0.0), fastest(0.0), momentum[Dim];
  for (Pack& component : momentum) component = Pack(0.0);
  for (const ParticleBin& bin : bins) {
    row.particles += bin.end - bin.begin;
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
      const Local n = bin.end - p;
      const Pack own = load_first<Pack>(m + p, n);
      Pack speed2(0.0);
      for (std::size_t d = 0; d < Dim; ++d) {
        const Pack component = load_first<Pack>(v[d] + p, n);
        speed2 += component * component;
        momentum[d] += own * component;
      }
      mass += own;
      kinetic += 0.5 * own * speed2;
      fastest = max(fastest, speed2);
    }
  }
  row.mass += reduce(mass);
  row.kinetic += reduce(kinetic);
  for (std::size_t d = 0; d < Dim; ++d) row.momentum[d] += reduce(momentum[d]);
  for (int lane = 0; lane < lanes<Pack>; ++lane)
    row.max_speed = std::max(row.max_speed, std::sqrt(fastest[lane]));
}

/// The liquid in the pores of particles [first, last) of one material.
template <int Dim>
void add_liquid(HistoryRow& row, const Particles<Dim>& particles, Local first, Local last,
                const Material& material) {
  if (!material.liquid) return;
  const Pores pores(*material.liquid);
  const double *m = particles.row(Column::mass), *V = particles.row(Column::volume);
  const auto v = particles.template rows<Dim>(Column::liquid_v);
  for (Local p = first; p < last; ++p) {
    const double mass = pores.liquid_mass(Scalar(m[p]), Scalar(V[p]))[0];
    double speed2 = 0;
    for (std::size_t d = 0; d < Dim; ++d) {
      speed2 += v[d][p] * v[d][p];
      row.momentum[d] += mass * v[d][p];
    }
    row.mass += mass;
    row.kinetic += 0.5 * mass * speed2;
    row.max_speed = std::max(row.max_speed, std::sqrt(speed2));
  }
}

}  // namespace

template <int Dim>
HistoryRow sums(Patch<Dim>& patch, const Model<Dim>& model) {
  HistoryRow row;
  add_particles<Dim>(row, patch.bins, patch.particles);
  if (model.analysis.two_phase)
    for (const ParticleBin& bin : patch.bins)
      add_liquid(row, patch.particles, bin.begin, bin.end, model.materials[bin.material]);
  for (const auto& out : patch.outbox) {
    const ParticleBin all{.cell = -1,
                          .begin = 0,
                          .end = out.particles.size(),
                          .limit = 0,
                          .material = 0,
                          .loaded = false};
    if (all.end > 0) add_particles<Dim>(row, {&all, 1}, out.particles);
    if (model.analysis.two_phase)
      for (Local p = 0; p < all.end; ++p)
        add_liquid(row, out.particles, p, p + 1,
                   model.materials[out.particles.material[static_cast<std::size_t>(p)]]);
  }
  row.internal = patch.work.internal;
  row.external = patch.work.external;
  row.damping = patch.work.damping;
  row.friction = patch.work.friction;
  row.divided = patch.work.divided;
  row.bodies.resize(patch.reactions.size());
  for (std::size_t k = 0; k < patch.reactions.size(); ++k) {
    row.bodies[k].force = patch.reactions[k].force;
    row.bodies[k].torque = patch.reactions[k].torque;
  }
  patch.work = {};
  return row;
}

template Frame snapshot<2>(const Patch<2>&, const Model<2>&, Frame);
template Frame snapshot<3>(const Patch<3>&, const Model<3>&, Frame);
template Index particles_of<2>(const Patch<2>&);
template Index particles_of<3>(const Patch<3>&);
template FrameHeader frame_header<2>(const ColumnLayout<2>&, const Model<2>&);
template FrameHeader frame_header<3>(const ColumnLayout<3>&, const Model<3>&);
template FrameSource frame_source<2>(const std::vector<const Patch<2>*>&, FrameHeader,
                                     const Model<2>&);
template FrameSource frame_source<3>(const std::vector<const Patch<3>*>&, FrameHeader,
                                     const Model<3>&);
template std::size_t frame_bytes<2>(const ColumnLayout<2>&, const Model<2>&, Index);
template std::size_t frame_bytes<3>(const ColumnLayout<3>&, const Model<3>&, Index);
template HistoryRow sums<2>(Patch<2>&, const Model<2>&);
template HistoryRow sums<3>(Patch<3>&, const Model<3>&);

}  // namespace lahar
