#include "runtime/step/shown_columns.h"

#include <algorithm>
#include <utility>

#include "physics/particles/liquid_content.h"

namespace lahar {

namespace {

/// Voigt components of a column's stored components: 2D stress xx yy zz xy, 2D strain xx yy xy.
template <int Dim>
int voigt(Column column, int component) {
  if (Dim == 2 && column == Column::strain && component == 2) return 3;
  return component;
}

/// The component zz of strains, where 2D has one; else null.
template <int Dim>
const double* strain_across(const Particles<Dim>& particles) {
  const bool stored = particles.layout().has(Column::strain_across);
  return stored ? particles.row(Column::strain_across) : nullptr;
}

/// Strain is shown even where it is not stored.
template <int Dim>
bool is_shown(const ColumnInfo& info, const ColumnLayout<Dim>& layout) {
  return info.exported && info.column != Column::state &&
         (layout.has(info.column) || info.column == Column::strain);
}

}  // namespace

template <int Dim>
std::vector<ParticleBlock<Dim>> blocks_of(const Patch<Dim>& patch) {
  std::vector<ParticleBlock<Dim>> blocks{{&patch.particles, patch.bins}};
  for (const auto& out : patch.outbox)
    if (out.particles.size() > 0) blocks.push_back({&out.particles, {}, true});
  return blocks;
}

template <int Dim>
ShownColumn<Dim>::ShownColumn(const ColumnInfo& info, const ColumnLayout<Dim>& layout,
                              const Model<Dim>& model)
    : model_(&model),
      stored_(layout.components(info)),
      info_(&info),
      tensor_(info.column == Column::stress || info.column == Column::strain),
      strain_of_stress_(!layout.has(info.column)) {}

template <int Dim>
ShownColumn<Dim>::ShownColumn(const DerivedField& field, const Model<Dim>& model)
    : model_(&model), stored_(field.components), field_(&field) {}

template <int Dim>
ShownColumn<Dim>::ShownColumn(const StateVariable& variable, const Model<Dim>& model)
    : model_(&model), stored_(1), variable_(&variable) {
  for (const Material& material : model.materials) {
    const auto all = state_variables(material.law);
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const StateVariable& v) { return v.name == variable.name; });
    component_.push_back(found == all.end() ? -1 : static_cast<int>(found - all.begin()));
  }
}

template <int Dim>
FrameColumn ShownColumn<Dim>::header() const {
  if (variable_) return {std::string(variable_->name), std::string(variable_->unit), 1, {}};
  if (field_) return {std::string(field_->name), std::string(field_->unit), field_->components, {}};
  return {info_->name, info_->unit, components(), {}};
}

template <int Dim>
void ShownColumn<Dim>::get(const ParticleBlock<Dim>& block, double* to) const {
  const Particles<Dim>& particles = *block.particles;
  const int width = components();
  const bool is_strain = info_ && info_->column == Column::strain;
  const double* across = is_strain ? strain_across(particles) : nullptr;
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
    if (across)
      for (Local p = begin; p < end; ++p) to[(p - begin) * width + 2] = across[p];
    to += static_cast<std::ptrdiff_t>(end - begin) * width;
  });
}

/// 0 for particles whose material does not have it.
template <int Dim>
[[gnu::noinline]] double ShownColumn<Dim>::state_variable(const Particles<Dim>& particles,
                                                          Local p) const {
  const auto material = particles.material[static_cast<std::size_t>(p)];
  const int k = component_[material];
  if (k < 0) return 0;
  const Law& law = model_->materials[material].law;
  const auto variables = state_variables(law);
  if (!variables[static_cast<std::size_t>(k)].of_stress) return particles.row(Column::state, k)[p];
  Voigt stress{};
  for (int c = 0; c < stress_components<Dim>; ++c)
    stress[static_cast<std::size_t>(c)] = particles.row(Column::stress, c)[p];
  std::vector<double> values(variables.size());
  derive_state(law, stress, values.data());
  return values[static_cast<std::size_t>(k)];
}

/// Never inlined: in a loop compilers make vectors of some particles, and fuse products and sums
/// there as they do not in what is left over. The last bit would depend on a particle's place.
template <int Dim>
[[gnu::noinline]] void ShownColumn<Dim>::derive_strain(const Particles<Dim>& particles, Local p,
                                                       double* to) const {
  const auto material = particles.material[static_cast<std::size_t>(p)];
  std::array<double, stress_components<Dim>> stress;
  for (std::size_t k = 0; k < stress.size(); ++k)
    stress[k] = particles.row(Column::stress, static_cast<int>(k))[p];
  const auto strain =
      strain_of<Dim>(std::get<LinearElastic>(model_->materials[material].law), stress);
  std::copy(strain.begin(), strain.end(), to);
}

template <int Dim>
ParticleValues ShownColumn<Dim>::values_of(const Particles<Dim>& particles, Local p) const {
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
  if (const double* across = strain_across(particles)) values.strain[2] = across[p];
  const auto& liquid = model_->materials[particles.material[static_cast<std::size_t>(p)]].liquid;
  if (!liquid) return values;
  const Pores pores(*liquid);
  values.porosity = pores.porosity(Scalar(values.mass), Scalar(values.volume))[0];
  values.liquid_mass = compressed_mass_of(liquid, particles, p);
  take(Column::pore_pressure, &values.pore_pressure);
  return values;
}

template <int Dim>
std::vector<ShownColumn<Dim>> shown_columns(const ColumnLayout<Dim>& layout,
                                            const Model<Dim>& model) {
  std::vector<ShownColumn<Dim>> columns;
  for (const ColumnInfo& info : column_table)
    if (is_shown(info, layout))
      columns.insert(info.column == Column::x ? columns.begin() : columns.end(),
                     ShownColumn<Dim>(info, layout, model));
  if (layout.has(Column::state))
    for (const StateVariable* variable : state_variables(model.materials))
      columns.push_back(ShownColumn<Dim>(*variable, model));
  for (const DerivedField* field : model.output.derived_fields)
    columns.push_back(ShownColumn<Dim>(*field, model));
  return columns;
}

template <int Dim>
std::optional<ShownColumn<Dim>> shown_column(std::string_view name, const ColumnLayout<Dim>& layout,
                                             const Model<Dim>& model) {
  for (const ShownColumn<Dim>& column : shown_columns<Dim>(layout, model))
    if (column.header().name == name) return column;
  for (const DerivedField& field : derived_fields)
    if (field.name == name) return ShownColumn<Dim>(field, model);
  return {};
}

template class ShownColumn<2>;
template class ShownColumn<3>;
template std::vector<ParticleBlock<2>> blocks_of<2>(const Patch<2>&);
template std::vector<ParticleBlock<3>> blocks_of<3>(const Patch<3>&);
template std::vector<ShownColumn<2>> shown_columns<2>(const ColumnLayout<2>&, const Model<2>&);
template std::vector<ShownColumn<3>> shown_columns<3>(const ColumnLayout<3>&, const Model<3>&);
template std::optional<ShownColumn<2>> shown_column<2>(std::string_view, const ColumnLayout<2>&,
                                                       const Model<2>&);
template std::optional<ShownColumn<3>> shown_column<3>(std::string_view, const ColumnLayout<3>&,
                                                       const Model<3>&);

}  // namespace lahar
