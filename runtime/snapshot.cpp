#include "runtime/snapshot.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "physics/law.h"

namespace lahar {

namespace {

/// Voigt components of a column's stored components: 2D stress xx yy zz xy, 2D strain xx yy xy.
template <int Dim>
int voigt(Column column, int component) {
  if (Dim == 2 && column == Column::strain && component == 2) return 3;
  return component;
}

/// Copy one value per particle of the runs to every `step`th place.
template <class From, class To>
void copy(std::span<const Run> runs, const From* from, To* to, std::size_t step) {
  for (const Run& run : runs)
    for (Local p = run.begin; p < run.end; ++p, to += step) *to = static_cast<To>(from[p]);
}

/// Strain of every particle of the runs where it is not stored, six components each.
template <int Dim>
void derive_strain(std::span<const Run> runs, const Particles<Dim>& particles,
                   const Model<Dim>& model, double* to) {
  const auto sigma = particles.template rows<stress_components<Dim>>(Column::stress);
  for (const Run& run : runs) {
    const auto& law = std::get<LinearElastic>(model.materials[run.material].law);
    for (Local p = run.begin; p < run.end; ++p, to += 6) {
      std::array<double, stress_components<Dim>> stress;
      for (std::size_t k = 0; k < stress.size(); ++k) stress[k] = sigma[k][p];
      const auto strain = strain_of<Dim>(law, stress);
      std::copy(strain.begin(), strain.end(), to);
    }
  }
}

template <int Dim>
void append(Frame& frame, std::span<const Run> runs, const Particles<Dim>& particles,
            const Model<Dim>& model) {
  std::size_t n = 0;
  for (const Run& run : runs) n += static_cast<std::size_t>(run.end - run.begin);
  const std::size_t before = frame.id.size();
  frame.id.resize(before + n);
  copy(runs, particles.id.data(), frame.id.data() + before, 1);
  for (const Run& run : runs)
    frame.material.insert(frame.material.end(), static_cast<std::size_t>(run.end - run.begin),
                          static_cast<std::int32_t>(model.materials[run.material].id));
  std::size_t k = 0;
  for (const ColumnInfo& info : column_table) {
    const bool has = particles.layout().has(info.column);
    const bool strain = info.column == Column::strain, stress = info.column == Column::stress;
    if (!info.exported || (!has && !strain)) continue;
    const bool coordinates = info.column == Column::x, tensor = stress || strain;
    const int stored = ColumnLayout<Dim>::components(info), shown = tensor ? 6 : stored;
    if (!coordinates && k == frame.columns.size())
      frame.columns.push_back({info.name, info.unit, shown, {}});
    auto& values = coordinates ? frame.coordinates : frame.columns[k++].values;
    const std::size_t at = values.size();
    values.resize(at + n * static_cast<std::size_t>(shown), 0.0);
    double* to = values.data() + at;
    if (!has) derive_strain(runs, particles, model, to);
    for (int c = 0; has && c < stored; ++c)
      copy(runs, particles.row(info.column, c), to + (tensor ? voigt<Dim>(info.column, c) : c),
           static_cast<std::size_t>(shown));
  }
}

/// All particles of an outbox, in runs of one material.
template <int Dim>
std::vector<Run> runs_of(const Particles<Dim>& particles) {
  std::vector<Run> runs;
  for (Local p = 0; p < particles.size(); ++p) {
    const auto material = particles.material[static_cast<std::size_t>(p)];
    if (runs.empty() || runs.back().material != material)
      runs.push_back(
          {.cell = -1, .begin = p, .end = p, .limit = p, .material = material, .loaded = false});
    ++runs.back().end;
  }
  return runs;
}

}  // namespace

template <int Dim>
Frame snapshot(const Patch<Dim>& patch, const Model<Dim>& model) {
  Frame frame;
  frame.dim = Dim;
  append<Dim>(frame, patch.runs, patch.particles, model);
  for (const auto& out : patch.outbox)
    if (out.particles.size() > 0) append<Dim>(frame, runs_of(out.particles), out.particles, model);
  return frame;
}

Frame merge(std::vector<Frame> pieces) {
  Frame all;
  if (pieces.empty()) return all;
  all.step = pieces.front().step;
  all.time = pieces.front().time;
  all.dim = pieces.front().dim;
  struct Key {
    Index id;
    std::uint32_t piece, position;
  };
  std::vector<Key> keys;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (std::size_t p = 0; p < pieces[i].id.size(); ++p)
      keys.push_back(
          {pieces[i].id[p], static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(p)});
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.id < b.id; });

  const auto gather = [&](auto& to, std::size_t components, auto member) {
    to.resize(keys.size() * components);
    auto* out = to.data();
    for (const Key& key : keys) {
      const auto* from = member(pieces[key.piece]).data() + key.position * components;
      out = std::copy(from, from + components, out);
    }
  };
  gather(
      all.id, 1, [](const Frame& f) -> auto& { return f.id; });
  gather(
      all.material, 1, [](const Frame& f) -> auto& { return f.material; });
  gather(
      all.coordinates, static_cast<std::size_t>(all.dim),
      [](const Frame& f) -> auto& { return f.coordinates; });
  for (std::size_t k = 0; k < pieces.front().columns.size(); ++k) {
    const FrameColumn& column = pieces.front().columns[k];
    all.columns.push_back({column.name, column.unit, column.components, {}});
    gather(
        all.columns.back().values,
        static_cast<std::size_t>(column.components), [k](const Frame& f) -> auto& {
          return f.columns[k].values;
        });
    for (Frame& piece : pieces) std::vector<double>().swap(piece.columns[k].values);
  }
  return all;
}

namespace {

template <int Dim>
void add_particles(HistoryRow& row, std::span<const Run> runs, const Particles<Dim>& particles) {
  const double* m = particles.row(Column::mass);
  const auto v = particles.template rows<Dim>(Column::v);
  Pack mass(0.0), kinetic(0.0), fastest(0.0), momentum[Dim];
  for (Pack& component : momentum) component = Pack(0.0);
  for (const Run& run : runs) {
    row.particles += run.end - run.begin;
    for (Local p = run.begin; p < run.end; p += lanes<Pack>) {
      const Local n = run.end - p;
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

}  // namespace

template <int Dim>
HistoryRow sums(Patch<Dim>& patch) {
  HistoryRow row;
  add_particles<Dim>(row, patch.runs, patch.particles);
  for (const auto& out : patch.outbox)
    if (out.particles.size() > 0) add_particles<Dim>(row, runs_of(out.particles), out.particles);
  row.internal = patch.work.internal;
  row.external = patch.work.external;
  row.damping = patch.work.damping;
  patch.work = {};
  return row;
}

void add(HistoryRow& row, const HistoryRow& part) {
  row.particles += part.particles;
  row.mass += part.mass;
  for (std::size_t d = 0; d < 3; ++d) row.momentum[d] += part.momentum[d];
  row.kinetic += part.kinetic;
  row.internal += part.internal;
  row.external += part.external;
  row.damping += part.damping;
  row.max_speed = std::max(row.max_speed, part.max_speed);
}

template Frame snapshot<2>(const Patch<2>&, const Model<2>&);
template Frame snapshot<3>(const Patch<3>&, const Model<3>&);
template HistoryRow sums<2>(Patch<2>&);
template HistoryRow sums<3>(Patch<3>&);

}  // namespace lahar
