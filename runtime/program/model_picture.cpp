#include "runtime/program/model_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "io/base/text.h"
#include "runtime/picture/svg.h"
#include "runtime/picture/view.h"
#include "runtime/program/material_colours.h"

namespace lahar {

namespace {

using Kind = ModelMark::Kind;

constexpr double margin_left = 70, margin_top = 74, view_distance = 74, legend_distance = 40,
                 legend_width = 400, line_height = 21;
constexpr std::array<double, 2> most_of_one{760, 560}, most_of_three{560, 300};
constexpr double squares_of_bodies = 300;  ///< along the longer edge of a view
constexpr const char* mesh_colour = "#e3e6ea";
constexpr std::size_t most_label_letters = 60;
/// Nodes of a set that has more of the places in its rows and columns are not drawn in that view.
constexpr double most_covered = 0.5;

std::string colour_of(Kind kind) {
  switch (kind) {
    case Kind::held:
      return "#222222";
    case Kind::moved:
      return "#7b2d8b";
    case Kind::wall:
      return "#8a4b16";
    case Kind::soft:
      return "#1f7a4d";
    case Kind::load:
      return "#c0271b";
    case Kind::water:
      return "#1762c4";
  }
  return "";
}

std::string shortened(const std::string& text) {
  const std::string plain = printable(text);
  if (plain.size() <= most_label_letters) return plain;
  return plain.substr(0, most_label_letters - 3) + "...";
}

template <int Dim>
class ModelPicture {
 public:
  ModelPicture(const Model<Dim>& model, const std::vector<ModelMark>& marks)
      : model_(model), marks_(marks), colours_(model.materials, model.particles.material) {
    make_views();
  }

  std::string draw() {
    double right = 0, bottom = 0;
    for (const View& view : views_) {
      right = std::max(right, view.left + view.size[0]);
      bottom = std::max(bottom, view.top + view.size[1]);
    }
    const double lines = static_cast<double>(2 * colours_.n_materials() +
                                             model_.rigid_bodies.size() + marks_.size() + 6);
    const double height = std::max(bottom + 60, margin_top + lines * line_height);
    Svg svg(right + legend_distance + legend_width, height);
    svg.text(margin_left - 40, 28, shortened(model_.title.empty() ? "Model" : model_.title), 17);
    for (const View& view : views_) draw_view(svg, view);
    draw_legend(svg, right + legend_distance);
    return svg.finish();
  }

 private:
  void make_views() {
    const auto [low, high] = model_.mesh->bounds();
    Vec<Dim> middle = 0.5 * (low + high);
    if (!model_.particles.x.empty()) {
      Vec<Dim> a = model_.particles.x.front(), b = a;
      for (const Vec<Dim>& x : model_.particles.x) a = a.cwiseMin(x), b = b.cwiseMax(x);
      middle = 0.5 * (a + b);
    }
    static constexpr const char* names = "xyz";
    const auto add = [&](std::string name, int across, int up, int normal, bool from_above) {
      View view{
          .name = std::move(name), .axes = {across, up}, .normal = normal, .low = {}, .high = {}};
      view.from_above = from_above;
      if (normal >= 0) view.at = middle[normal];
      for (std::size_t d = 0; d < 2; ++d) {
        view.low[d] = low[view.axes[d]];
        view.high[d] = high[view.axes[d]];
      }
      view.fit(Dim == 2 ? most_of_one : most_of_three);
      view.left = margin_left;
      view.top =
          views_.empty() ? margin_top : views_.back().top + views_.back().size[1] + view_distance;
      views_.push_back(view);
    };
    if (Dim == 2) return add("Model", 0, 1, -1, false);
    add("Plan", 0, 1, 2, true);
    for (const int normal : {1, 0})
      add(fmt::format("Section at {} = {:.4g} m", names[normal], middle[normal]), 1 - normal, 2,
          normal, false);
  }

  void draw_view(Svg& svg, const View& view) {
    draw_mesh(svg, view);
    draw_bodies(svg, view);
    draw_particles(svg, view);
    draw_mesh_lines(svg, view);
    for (std::size_t k = 0; k < marks_.size(); ++k) draw_mark(svg, view, marks_[k], k + 1);
    view.draw_axes(svg);
    draw_gravity(svg, view);
  }

  /// Cells of a mesh from tables; a grid fills the view.
  void draw_mesh(Svg& svg, const View& view) const {
    const Mesh<Dim>& mesh = *model_.mesh;
    ViewRaster raster(view);
    if (mesh.is_structured())
      raster.fill(view.low, view.high, 0);
    else
      for (Index cell = 0; cell < mesh.n_cells(); ++cell) {
        const auto [low, high] = mesh.cell_bounds(cell);
        if (!cuts(view, low, high)) continue;
        const auto [a, b] = box_in(view, low, high);
        raster.fill(a, b, 0);
      }
    raster.draw(svg, [](int) { return mesh_colour; });
  }

  /// Lines of cells that are large enough to be seen.
  void draw_mesh_lines(Svg& svg, const View& view) const {
    if (!model_.mesh->is_structured()) return;
    constexpr double nearest = 6;  // [px]
    const Svg::Style style{.stroke = "#9aa2ad", .width = 0.5, .dash = {}, .opacity = 0.6};
    const double right = view.left + view.size[0], bottom = view.top + view.size[1];
    for (std::size_t d = 0; d < 2; ++d) {
      const Index n = model_.mesh->counts()[static_cast<std::size_t>(view.axes[d])];
      const double step = view.size[d] / static_cast<double>(n);
      if (step < nearest) continue;
      for (Index k = 1; k < n; ++k) {
        const double at = (d == 0 ? view.left : view.top) + static_cast<double>(k) * step;
        if (d == 0)
          svg.line(at, view.top, at, bottom, style);
        else
          svg.line(view.left, at, right, at, style);
      }
    }
  }

  /// Rigid bodies where they begin. From above, those with an end on all sides alone are seen: a
  /// hill would be everywhere.
  void draw_bodies(Svg& svg, const View& view) const {
    const double square =
        std::max(view.high[0] - view.low[0], view.high[1] - view.low[1]) / squares_of_bodies;
    ViewRaster raster(view);
    for (std::size_t k = 0; k < model_.rigid_bodies.size(); ++k) {
      const Solid<Dim>& solid = *model_.rigid_bodies[k].solid;
      const auto [low, high] = solid.bounds();
      if (view.from_above && !(low.allFinite() && high.allFinite())) continue;
      Vec<Dim> x = Vec<Dim>::Zero();
      if (view.normal >= 0)
        x[view.normal] = view.from_above ? 0.5 * (low + high)[view.normal] : view.at;
      for (double a = view.low[0]; a < view.high[0]; a += square)
        for (double b = view.low[1]; b < view.high[1]; b += square) {
          x[view.axes[0]] = a + 0.5 * square;
          x[view.axes[1]] = b + 0.5 * square;
          if (solid.nearest(x).distance <= 0)
            raster.fill({a, b}, {a + square, b + square}, static_cast<int>(k));
        }
    }
    raster.draw(svg, [&](int k) { return body_colour(static_cast<std::size_t>(k)); });
  }

  static const char* body_colour(std::size_t k) {
    static constexpr const char* greys[] = {"#6f6a64", "#4c5560", "#8a8178", "#3d3a36"};
    return greys[k % std::size(greys)];
  }

  static std::string body_label(const RigidBody<Dim>& body) {
    using Motion = typename RigidBody<Dim>::Motion;
    const char* motion = body.motion == Motion::fixed        ? "rigid"
                         : body.motion == Motion::prescribed ? "rigid, moves"
                                                             : "rigid, free";
    const std::string friction =
        std::isinf(body.friction) ? "rough" : fmt::format("friction {:.4g}", body.friction);
    return fmt::format("{}: {}, {}", body.name, motion, friction);
  }

  /// Of the box of a particle [m], which has the shape of its cell.
  Vec<Dim> half_edges(std::size_t p) const {
    const ParticleTable<Dim>& table = model_.particles;
    const double depth = Dim == 2 ? depth_at(model_.analysis, table.x[p][0]) : 1.0;
    const auto [low, high] = model_.mesh->cell_bounds(table.cell[p]);
    const Vec<Dim> edges = high - low;
    return 0.5 * std::pow(table.volume[p] / depth / edges.prod(), 1.0 / Dim) * edges;
  }

  void draw_particles(Svg& svg, const View& view) const {
    const ParticleTable<Dim>& table = model_.particles;
    ViewRaster raster(view);
    for (std::size_t p = 0; p < table.x.size(); ++p) {
      const Vec<Dim>& x = table.x[p];
      const Vec<Dim> edge = half_edges(p);
      if (!cuts(view, x - edge, x + edge)) continue;
      const auto [low, high] = box_in(view, x - edge, x + edge);
      double height = 0;
      if (view.normal >= 0)
        height = view.from_above ? x[view.normal] : -std::abs(x[view.normal] - view.at);
      raster.fill(low, high, colours_.first(table.material[p]), height);
    }
    raster.draw(svg, [&](int m) { return colours_.of(m); });
  }

  /// Whether a box is in the section of a view.
  bool cuts(const View& view, const Vec<Dim>& low, const Vec<Dim>& high) const {
    if (view.normal < 0 || view.from_above) return true;
    const int n = view.normal;
    return low[n] <= view.at && view.at <= high[n];
  }

  static std::pair<std::array<double, 2>, std::array<double, 2>> box_in(const View& view,
                                                                        const Vec<Dim>& low,
                                                                        const Vec<Dim>& high) {
    const auto [a, b] = view.axes;
    return {{low[a], low[b]}, {high[a], high[b]}};
  }

  /// Where nodes and particles of a mark are in a view, one per square; of sections those within a
  /// cell of it.
  std::vector<std::array<double, 2>> places(const View& view, const ModelMark& mark) const {
    ViewRaster raster(view);
    const double cell = view.normal < 0 ? 0.0 : thickness(view.normal);
    const auto add = [&](const Vec<Dim>& x) {
      if (view.normal >= 0 && !view.from_above && std::abs(x[view.normal] - view.at) > cell) return;
      const std::array<double, 2> at{x[view.axes[0]], x[view.axes[1]]};
      raster.fill(at, at, 0);
    };
    for (const Index node : mark.nodes) add(model_.mesh->node(node));
    for (const Index p : mark.particles) add(model_.particles.x[static_cast<std::size_t>(p)]);
    return raster.filled();
  }

  /// An edge of a cell along an axis, in the mean [m].
  double thickness(int axis) const {
    const Mesh<Dim>& mesh = *model_.mesh;
    if (!mesh.is_structured()) return mesh.mean_cell()[axis];
    const auto [low, high] = mesh.bounds();
    return (high[axis] - low[axis]) /
           static_cast<double>(mesh.counts()[static_cast<std::size_t>(axis)]);
  }

  /// Whether places fill an area: drawn, they would hide the rest.
  static bool covers(const View& view, const std::vector<std::array<double, 2>>& at) {
    if (view.normal < 0) return false;
    std::array<std::set<double>, 2> along;
    for (const auto& x : at)
      for (std::size_t d = 0; d < 2; ++d) along[d].insert(x[d]);
    constexpr std::size_t line = 3;  // of so many rows at most
    if (along[0].size() <= line || along[1].size() <= line) return false;
    return static_cast<double>(at.size()) >
           most_covered * static_cast<double>(along[0].size() * along[1].size());
  }

  void draw_mark(Svg& svg, const View& view, const ModelMark& mark, std::size_t number) const {
    if (mark.kind == Kind::water) return draw_water(svg, view, mark);
    const auto at = places(view, mark);
    if (at.empty() || covers(view, at)) return;
    const std::string colour = colour_of(mark.kind);
    std::array<double, 2> mean{};
    for (const auto& x : at) {
      const auto [px, py] = view.place(x[0], x[1]);
      svg.rectangle(px - 2, py - 2, 4, 4, {.fill = colour});
      for (std::size_t d = 0; d < 2; ++d) mean[d] += x[d] / static_cast<double>(at.size());
    }
    const auto distance = [&](const std::array<double, 2>& x) {
      return std::hypot(x[0] - mean[0], x[1] - mean[1]);
    };
    const auto nearest = *std::min_element(at.begin(), at.end(), [&](const auto& a, const auto& b) {
      return distance(a) < distance(b);
    });
    const auto [px, py] = view.place(nearest[0], nearest[1]);
    draw_direction(svg, view, mark, px, py);
    draw_number(svg, beside(view.left, view.size[0], px), beside(view.top, view.size[1], py),
                number, colour);
  }

  /// A place a little nearer to the middle, so that a number does not hide what it names.
  static double beside(double from, double size, double at) {
    const double middle = from + 0.5 * size;
    return at + std::clamp(middle - at, -14.0, 14.0);
  }

  static void draw_number(Svg& svg, double x, double y, std::size_t number,
                          const std::string& colour) {
    svg.circle(x, y, 8.5, {.fill = "#ffffff", .stroke = colour, .width = 1.5});
    svg.text(x, y + 4, fmt::format("{}", number), 11, "middle", colour.c_str());
  }

  void draw_direction(Svg& svg, const View& view, const ModelMark& mark, double x, double y) const {
    if (mark.kind != Kind::load && mark.kind != Kind::moved) return;
    const double a = mark.direction[static_cast<std::size_t>(view.axes[0])],
                 b = mark.direction[static_cast<std::size_t>(view.axes[1])];
    if (a != 0 || b != 0) svg.arrow(x, y, a, b, 40, {.stroke = colour_of(mark.kind), .width = 2.5});
  }

  void draw_gravity(Svg& svg, const View& view) const {
    const double a = model_.gravity[view.axes[0]], b = model_.gravity[view.axes[1]];
    if (std::hypot(a, b) < 1e-3 * model_.gravity.norm() || model_.gravity.isZero(0.0)) return;
    constexpr double length = 34;
    const double x = view.left + view.size[0] - 34, y = view.top + 34, norm = std::hypot(a, b);
    svg.arrow(x - 0.5 * length * a / norm, y + 0.5 * length * b / norm, a, b, length,
              {.stroke = "#222222", .width = 2.5});
    svg.text(x + 12, y + 4, "g", 13);
  }

  void draw_water(Svg& svg, const View& view, const ModelMark& mark) const {
    if (view.axes[0] != mark.along || view.axes[1] != mark.up) return;
    std::vector<std::pair<double, double>> line;
    const auto add = [&](double at, double level) {
      line.push_back(view.place(std::clamp(at, view.low[0], view.high[0]),
                                std::clamp(level, view.low[1], view.high[1])));
    };
    add(view.low[0], mark.levels.front()[1]);
    for (const auto& [at, level] : mark.levels) add(at, level);
    add(view.high[0], mark.levels.back()[1]);
    svg.polyline(line, {.stroke = colour_of(mark.kind), .width = 2, .dash = "7 4"});
  }

  void draw_legend(Svg& svg, double left) const {
    double y = margin_top;
    const auto line = [&](const std::string& text, const char* colour = "#222222") {
      svg.text(left + 28, y + 4, shortened(text), 13, "start", colour);
      y += line_height;
    };
    std::map<Index, Index> particles;
    for (const auto m : model_.particles.material) ++particles[model_.materials[m].id];
    std::map<Index, bool> drawn;
    for (const Material& material : model_.materials) {
      if (std::exchange(drawn[material.id], true)) continue;
      const int m = static_cast<int>(&material - model_.materials.data());
      svg.rectangle(left, y - 8, 18, 15,
                    {.fill = colours_.of(m), .stroke = "#777777", .width = 0.8});
      const Index n = particles[material.id];
      line(fmt::format("{}, {}", material.name,
                       n > 0 ? counted(n, "particle") : "no particles of its own"));
      if (colours_.has_shades(m)) line("darker where its field is larger", "#5b6570");
    }
    for (std::size_t k = 0; k < model_.rigid_bodies.size(); ++k) {
      svg.rectangle(left, y - 8, 18, 15,
                    {.fill = body_colour(k), .stroke = "#777777", .width = 0.8});
      line(body_label(model_.rigid_bodies[k]));
    }
    y += line_height / 2;
    for (std::size_t k = 0; k < marks_.size(); ++k) {
      const std::string colour = colour_of(marks_[k].kind);
      if (marks_[k].kind == Kind::water)
        svg.line(left, y, left + 18, y, {.stroke = colour, .width = 2, .dash = "7 4"});
      else
        draw_number(svg, left + 9, y, k + 1, colour);
      line(marks_[k].label);
    }
    y += line_height / 2;
    if (const double g = model_.gravity.norm(); g > 0)
      line(fmt::format("gravity {:.4g} m/s^2{}", g, model_.gravity_function >= 0 ? ", grows" : ""));
    line(fmt::format("mesh of {}", counted(model_.mesh->n_cells(), "cell")), "#5b6570");
  }

  static std::string counted(Index n, const char* what) {
    return fmt::format("{} {}{}", format_count(n), what, n == 1 ? "" : "s");
  }

  const Model<Dim>& model_;
  const std::vector<ModelMark>& marks_;
  MaterialColours colours_;
  std::vector<View> views_;
};

}  // namespace

std::string model_picture(const AnyModel& model, const std::vector<ModelMark>& marks) {
  return std::visit(
      [&]<int Dim>(const Model<Dim>& of) { return ModelPicture<Dim>(of, marks).draw(); }, model);
}

}  // namespace lahar
