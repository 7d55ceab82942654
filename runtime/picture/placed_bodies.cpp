#include "runtime/picture/placed_bodies.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "io/run/history.h"
#include "physics/model/rigid_body.h"

namespace lahar {

PlacedBodies::PlacedBodies(const std::filesystem::path& run) : shapes_(read_body_shapes(run)) {
  rows_.resize(shapes_.size());
  if (shapes_.empty() || !std::filesystem::exists(run / rigid_bodies_file)) return;
  const Table table = read_table(run / rigid_bodies_file);
  const TableColumn* body = table.find("body");
  const auto values = [&](const char* name) { return table.values(name); };
  const std::vector<double> time = values("time");
  const std::array<std::vector<double>, 3> place{values("x"), values("y"), values("z")},
      rotation{values("rotation_x"), values("rotation_y"), values("rotation_z")};
  for (std::size_t i = 0; i < table.rows(); ++i)
    for (std::size_t k = 0; k < shapes_.size(); ++k) {
      if (!body || body->texts[i] != shapes_[k].name) continue;
      rows_[k].push_back({.time = time[i],
                          .place = {place[0][i], place[1][i], place[2][i]},
                          .rotation = {rotation[0][i], rotation[1][i], rotation[2][i]}});
    }
}

std::optional<std::size_t> PlacedBodies::find(const std::string& name) const {
  const auto found = std::ranges::find(shapes_, name, &BodyShape::name);
  if (found == shapes_.end()) return {};
  return static_cast<std::size_t>(found - shapes_.begin());
}

BodyPose PlacedBodies::pose(std::size_t body, double time) const {
  const std::vector<Row>& rows = rows_[body];
  BodyPose pose{.place = Vec<3>(shapes_[body].centre.data())};
  if (rows.empty()) return pose;
  const auto after = std::ranges::lower_bound(rows, time, {}, &Row::time);
  const Row& b = after == rows.end() ? rows.back() : *after;
  const Row& a = after == rows.begin() ? b : *std::prev(after);
  const double share =
      b.time > a.time ? std::clamp((time - a.time) / (b.time - a.time), 0.0, 1.0) : 1.0;
  pose.place = a.place + share * (b.place - a.place);
  const Eigen::Quaterniond from(rotation_by<3>(a.rotation)), to(rotation_by<3>(b.rotation));
  pose.axes = from.slerp(share, to).toRotationMatrix();
  return pose;
}

std::vector<PlacedBody> PlacedBodies::at(double time) const {
  std::vector<PlacedBody> bodies;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const BodyPose pose = this->pose(k, time);
    const Vec<3> centre(shapes_[k].centre.data());
    PlacedBody& body = bodies.emplace_back();
    body.name = shapes_[k].name;
    body.moves = std::any_of(rows_[k].begin(), rows_[k].end(), [&](const Row& row) {
      return row.place != rows_[k].front().place || row.rotation != rows_[k].front().rotation;
    });
    const auto place = [&](const Vec<3>& x) {
      body.points.push_back(pose.place + pose.axes * (x - centre));
    };
    if (const auto* lines = std::get_if<Lines>(&shapes_[k].surface)) {
      for (const Vec<2>& x : lines->points) place({x[0], x[1], 0});
      body.lines = lines->corners;
    } else {
      const Triangles& triangles = std::get<Triangles>(shapes_[k].surface);
      for (const Vec<3>& x : triangles.points) place(x);
      body.triangles = triangles.corners;
    }
  }
  return bodies;
}

}  // namespace lahar
