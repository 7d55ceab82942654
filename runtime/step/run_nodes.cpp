#include "runtime/step/run_nodes.h"

#include <algorithm>
#include <string>
#include <utility>

namespace lahar {

namespace {

const NodeFieldInfo& info_of(NodeField field) {
  return *std::find_if(node_field_table.begin(), node_field_table.end(),
                       [&](const NodeFieldInfo& info) { return info.field == field; });
}

template <int Dim>
FrameColumn column_of(NodeField field) {
  const NodeFieldInfo& info = info_of(field);
  return {std::string(info.name), std::string(info.unit), info.is_vector ? Dim : 1, {}};
}

template <int Dim>
std::vector<double> values_of(NodeField field, const ShownNodes& shown) {
  const bool mass = field == NodeField::mass;
  const NodeArray& from = field == NodeField::acceleration ? shown.acceleration : shown.velocity;
  const std::ptrdiff_t first = mass ? mass_lane : 0, n = mass ? 1 : Dim;
  std::vector<double> values;
  values.reserve(shown.node.size() * static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < shown.node.size(); ++i) {
    const auto node = from.begin() + static_cast<std::ptrdiff_t>(i) * node_width;
    values.insert(values.end(), node + first, node + first + n);
  }
  return values;
}

}  // namespace

template <int Dim>
std::size_t RunNodes<Dim>::bytes() const {
  if (!any()) return 0;
  std::size_t nodes = 0, numbers = 1 + Dim;  // id and place
  for (int i = 0; i < patches_.size(); ++i)
    for (const NodeRange& range : patches_[i].active_nodes)
      nodes += static_cast<std::size_t>(range.end - range.begin);
  for (const NodeField field : model_.output.node_fields)
    numbers += static_cast<std::size_t>(column_of<Dim>(field).components);
  return nodes * numbers * sizeof(double);
}

template <int Dim>
void RunNodes<Dim>::make_room() {
  if (!any()) return;
  for (auto& pieces : pieces_) pieces.assign(static_cast<std::size_t>(patches_.size()), {});
}

template <int Dim>
void RunNodes<Dim>::copy(int patch, Step step) {
  if (any()) pieces_[step][static_cast<std::size_t>(patch)] = piece(patches_[patch], step);
}

template <int Dim>
FramePieces RunNodes<Dim>::take(Step step) {
  FramePieces nodes{header(step + 1), std::move(pieces_[step])};
  pieces_[step].assign(nodes.pieces.size(), {});
  return nodes;
}

template <int Dim>
FramePieces RunNodes<Dim>::present(Step at) const {
  FramePieces nodes{header(at), {}};
  for (int i = 0; i < patches_.size(); ++i) nodes.pieces.push_back(piece(patches_[i], at - 1));
  return nodes;
}

template <int Dim>
std::optional<FramePieces> RunNodes<Dim>::kept(Step at) const {
  if (kept_ && kept_->header.step == at) return kept_;
  return {};
}

template <int Dim>
FrameHeader RunNodes<Dim>::header(Step at) const {
  FrameHeader header{.step = at,
                     .time = time_.time_at(at),
                     .dim = Dim,
                     .material = false,
                     .single = model_.output.single_precision,
                     .columns = {}};
  for (const NodeField field : model_.output.node_fields)
    header.columns.push_back(column_of<Dim>(field));
  return header;
}

template <int Dim>
Frame RunNodes<Dim>::piece(const Patch<Dim>& patch, Step step) const {
  Frame frame;
  frame.dim = Dim;
  // A patch without particles may have left out the step.
  static const ShownNodes none;
  const ShownNodes& shown = patch.shown_nodes.step == step ? patch.shown_nodes : none;
  for (const Local node : shown.node) {
    const Index id = patch.topology.nodes[static_cast<std::size_t>(node)];
    const auto x = model_.mesh->node(id);
    frame.id.push_back(id);
    frame.coordinates.insert(frame.coordinates.end(), x.data(), x.data() + Dim);
  }
  for (const NodeField field : model_.output.node_fields) {
    frame.columns.push_back(column_of<Dim>(field));
    frame.columns.back().values = values_of<Dim>(field, shown);
  }
  return frame;
}

template class RunNodes<2>;
template class RunNodes<3>;

}  // namespace lahar
