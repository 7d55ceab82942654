#include "runtime/step/snapshot.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "physics/particles/liquid_content.h"
#include "runtime/step/shown_columns.h"

namespace lahar {

namespace {

/// The columns of a frame that the model wants; coordinates first.
template <int Dim>
std::vector<ShownColumn<Dim>> frame_columns(const ColumnLayout<Dim>& layout,
                                            const Model<Dim>& model) {
  auto columns = shown_columns<Dim>(layout, model);
  const auto& wanted = model.output.frame_fields;
  if (wanted.empty()) return columns;
  std::erase_if(columns, [&](const ShownColumn<Dim>& column) {
    const std::string name = column.header().name;
    return name != "coordinates" && std::find(wanted.begin(), wanted.end(), name) == wanted.end();
  });
  return columns;
}

/// The particles of a patch that frames have. Blocks of a set have runs of slots as bins.
template <int Dim>
class FrameBlocks {
 public:
  FrameBlocks(const Patch<Dim>& patch, const Model<Dim>& model) : blocks_(blocks_of(patch)) {
    if (model.output.frame_particles)
      for (ParticleBlock<Dim>& block : blocks_) keep(block, *model.output.frame_particles);
  }

  const std::vector<ParticleBlock<Dim>>& all() const { return blocks_; }
  Index size() const {
    Index n = 0;
    for (const ParticleBlock<Dim>& block : blocks_)
      block.for_each_range([&](Local begin, Local end) { n += end - begin; });
    return n;
  }

 private:
  /// Those of a block whose ids are in a list.
  void keep(ParticleBlock<Dim>& block, const std::vector<Index>& ids) {
    std::vector<ParticleBin>& runs = runs_.emplace_back();
    const auto add = [&](Local p) {
      if (!runs.empty() && runs.back().end == p)
        ++runs.back().end;
      else
        runs.push_back(
            {.cell = -1, .begin = p, .end = p + 1, .limit = p + 1, .material = 0, .loaded = false});
    };
    block.for_each_range([&](Local begin, Local end) {
      for (Local p = begin; p < end; ++p)
        if (std::binary_search(ids.begin(), ids.end(),
                               block.particles->id[static_cast<std::size_t>(p)]))
          add(p);
    });
    block = {block.particles, runs};
  }

  std::vector<ParticleBlock<Dim>> blocks_;
  std::vector<std::vector<ParticleBin>> runs_;  ///< which blocks see
};

/// `all`: particles that the frame will have.
template <int Dim>
void append_block(Frame& frame, const ParticleBlock<Dim>& block, Index all,
                  const Model<Dim>& model) {
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
  const auto columns = frame_columns<Dim>(particles.layout(), model);
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
  const FrameBlocks<Dim> blocks(patch, model);
  const Index n = blocks.size();
  frame.id.reserve(static_cast<std::size_t>(n));
  frame.material.reserve(static_cast<std::size_t>(n));
  for (const ParticleBlock<Dim>& block : blocks.all()) append_block(frame, block, n, model);
  return frame;
}

template <int Dim>
Index particles_of(const Patch<Dim>& patch, const Model<Dim>& model) {
  if (model.output.frame_particles) return FrameBlocks<Dim>(patch, model).size();
  Index n = 0;
  for (const ParticleBin& bin : patch.bins) n += bin.end - bin.begin;
  for (const auto& out : patch.outbox) n += out.particles.size();
  return n;
}

template <int Dim>
FrameHeader frame_header(const ColumnLayout<Dim>& layout, const Model<Dim>& model) {
  FrameHeader header;
  header.dim = Dim;
  header.single = model.output.single_precision;
  const auto columns = frame_columns<Dim>(layout, model);
  for (std::size_t k = 1; k < columns.size(); ++k) header.columns.push_back(columns[k].header());
  return header;
}

template <int Dim>
FrameSource frame_source(const std::vector<const Patch<Dim>*>& patches, FrameHeader header,
                         const Model<Dim>& model) {
  FrameSource frame;
  frame.header = std::move(header);
  for (const Patch<Dim>* patch : patches) frame.sizes.push_back(particles_of(*patch, model));
  frame.piece = [patches, &model](std::size_t i) { return snapshot(*patches[i], model); };
  return frame;
}

template <int Dim>
std::size_t frame_bytes(const ColumnLayout<Dim>& layout, const Model<Dim>& model, Index particles) {
  std::size_t bytes = sizeof(Index) + sizeof(std::int32_t);
  for (const auto& column : frame_columns<Dim>(layout, model))
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
  const auto v = particles.template rows<Dim>(Column::liquid_v);
  for (Local p = first; p < last; ++p) {
    const double mass = compressed_mass_of(material.liquid, particles, p);
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
template Index particles_of<2>(const Patch<2>&, const Model<2>&);
template Index particles_of<3>(const Patch<3>&, const Model<3>&);
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
