#include "runtime/snapshot.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lahar {

namespace {

/// Voigt components of a column's stored components: 2D stress xx yy zz xy, 2D strain xx yy xy.
template <int Dim>
int voigt(Column column, int component) {
  if (Dim == 2 && column == Column::strain && component == 2) return 3;
  return component;
}

template <int Dim>
void append(Frame& frame, const Particles<Dim>& particles, const Model<Dim>& model) {
  const auto n = static_cast<std::size_t>(particles.size());
  frame.id.insert(frame.id.end(), particles.id.begin(), particles.id.end());
  for (std::size_t p = 0; p < n; ++p)
    frame.material.push_back(static_cast<std::int32_t>(model.materials[particles.material[p]].id));
  std::size_t k = 0;
  for (const ColumnInfo& info : column_table) {
    if (!info.exported || !particles.layout().has(info.column)) continue;
    const bool coordinates = info.column == Column::x;
    const bool tensor = info.column == Column::stress || info.column == Column::strain;
    const int stored = ColumnLayout<Dim>::components(info), shown = tensor ? 6 : stored;
    if (!coordinates && k == frame.columns.size())
      frame.columns.push_back({info.name, info.unit, shown, {}});
    auto& to = coordinates ? frame.coordinates : frame.columns[k++].values;
    const std::size_t at = to.size();
    to.resize(at + n * static_cast<std::size_t>(shown), 0.0);
    for (int c = 0; c < stored; ++c) {
      const double* from = particles.row(info.column, c);
      double* column = to.data() + at + (tensor ? voigt<Dim>(info.column, c) : c);
      for (std::size_t p = 0; p < n; ++p) column[p * static_cast<std::size_t>(shown)] = from[p];
    }
  }
}

}  // namespace

template <int Dim>
Frame snapshot(const Patch<Dim>& patch, const Model<Dim>& model) {
  Frame frame;
  frame.dim = Dim;
  append(frame, patch.particles, model);
  for (const auto& out : patch.outbox) append(frame, out.particles, model);
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
void add_particles(HistoryRow& row, const Particles<Dim>& particles) {
  const double* m = particles.row(Column::mass);
  row.particles += particles.size();
  for (Local p = 0; p < particles.size(); ++p) {
    double speed2 = 0.0;
    for (int d = 0; d < Dim; ++d) {
      const double v = particles.row(Column::v, d)[p];
      speed2 += v * v;
      row.momentum[static_cast<std::size_t>(d)] += m[p] * v;
    }
    row.mass += m[p];
    row.kinetic += 0.5 * m[p] * speed2;
    row.max_speed = std::max(row.max_speed, std::sqrt(speed2));
  }
}

}  // namespace

template <int Dim>
HistoryRow sums(Patch<Dim>& patch) {
  HistoryRow row;
  add_particles(row, patch.particles);
  for (const auto& out : patch.outbox) add_particles(row, out.particles);
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
