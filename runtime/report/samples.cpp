#include "runtime/report/samples.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "io/base/base64.h"
#include "io/frames/vtkhdf.h"
#include "physics/base/error.h"
#include "physics/geometry/coarse_triangles.h"

namespace lahar {

namespace {

/// A number that looks random, from an id (the finaliser of SplitMix64).
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Particles of a frame that are shown. Their order is that of numbers which look random, so that
/// any first part of them is spread over the body.
std::vector<std::size_t> chosen(const Frame& frame, double share) {
  const auto limit = static_cast<double>(std::numeric_limits<std::uint64_t>::max()) * share;
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t p = 0; p < frame.id.size(); ++p) {
    const std::uint64_t number = mixed(static_cast<std::uint64_t>(frame.id[p]) + 1);
    if (share >= 1 || static_cast<double>(number) < limit) order.emplace_back(number, p);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> list;
  list.reserve(order.size());
  for (const auto& [number, p] : order) list.push_back(p);
  return list;
}

double median_edge(const Frame& frame, const std::vector<std::size_t>& list, bool axisymmetric) {
  const std::vector<double> edges = edges_of(frame, axisymmetric);
  std::vector<double> those;
  for (const std::size_t p : list)
    if (std::isfinite(edges[p])) those.push_back(edges[p]);
  if (those.empty()) return 0;
  const auto middle = those.begin() + static_cast<std::ptrdiff_t>(those.size() / 2);
  std::nth_element(those.begin(), middle, those.end());
  return *middle;
}

template <class Number>
void append(std::string& bytes, Number value) {
  for (std::size_t k = 0; k < sizeof(Number); ++k)
    bytes += static_cast<char>(value >> (8 * k) & 0xFFu);
}

}  // namespace

std::vector<ReportFrame> frames_of(const RunResults& run) {
  std::vector<ReportFrame> frames;
  for (const RunPart& part : run.parts)
    for (const FrameFile& file : part.frames) frames.push_back({&part, file});
  return frames;
}

std::vector<ReportFrame> spread(const std::vector<ReportFrame>& frames, std::size_t count) {
  if (frames.size() <= count) return frames;
  if (count < 2) return {frames.back()};
  std::vector<ReportFrame> some;
  for (std::size_t k = 0; k < count; ++k)
    some.push_back(frames[(k * (frames.size() - 1) + (count - 1) / 2) / (count - 1)]);
  return some;
}

std::vector<ReportFrame> nearest(const std::vector<ReportFrame>& frames,
                                 const std::vector<double>& times) {
  std::vector<double> of_frames;
  for (const ReportFrame& frame : frames)
    of_frames.push_back(frame.part->begin + read_frame_header(frame.file.file).time);
  std::set<std::size_t> chosen;
  for (const double time : times)
    if (!frames.empty()) chosen.insert(nearest_in(of_frames, time));
  std::vector<ReportFrame> some;
  for (const std::size_t k : chosen) some.push_back(frames[k]);
  return some;
}

std::vector<std::string> usual_fields(const FrameHeader& header) {
  constexpr std::size_t most = 3;
  const std::vector<std::string> names = field_names(header);
  std::vector<std::string> fields;
  for (const char* name : {"speed", "displacement", "pore_pressure", "pdstrain", "mean_stress",
                           "equivalent_strain", "pressure"})
    if (fields.size() < most && std::find(names.begin(), names.end(), name) != names.end())
      fields.emplace_back(name);
  return fields;
}

RunSamples sample(const RunResults& run, const std::vector<std::string>& fields,
                  const SampleBudget& budget) {
  RunSamples samples;
  const std::vector<ReportFrame> all = frames_of(run);
  if (all.empty()) return samples;
  const FrameHeader header = read_frame_header(all.front().file.file);
  std::vector<std::string> columns{"volume"};
  for (const std::string& field : fields)
    for (const std::string& column : columns_of_field(header, field)) columns.push_back(column);
  double bytes_of_particle = 8.0 + 24.0;
  for (const FrameColumn& column : header.columns)
    if (std::find(columns.begin(), columns.end(), column.name) != columns.end())
      bytes_of_particle += 8.0 * column.components;
  double most = 0;
  for (const RunPart& part : run.parts) most = std::max(most, part.model("particles"));
  const double share = most > 0 ? std::min(1.0, static_cast<double>(budget.points) / most) : 1.0;
  const auto count = static_cast<std::size_t>(
      std::clamp(budget.bytes / (std::max(1.0, most) * bytes_of_particle), 8.0,
                 static_cast<double>(std::max<std::size_t>(budget.frames, 8))));
  samples.dim = header.dim;
  samples.bodies = all.front().part->shapes.shapes();
  constexpr std::size_t least_triangles = 500;  // show what a body is
  for (BodyShape& body : samples.bodies)
    if (auto* surface = std::get_if<Triangles>(&body.surface))
      *surface = coarser(std::move(*surface),
                         std::max(least_triangles, budget.triangles / samples.bodies.size()));
  std::vector<std::vector<double>> values(fields.size());
  for (const ReportFrame& at : spread(all, std::min(count, budget.frames))) {
    const Frame frame = read_frame(at.file.file, columns);
    if (frame.id.empty()) continue;
    const std::vector<std::size_t> list = chosen(frame, share);
    SampledFrame to{.step = frame.step,
                    .time = at.part->begin + frame.time,
                    .stage = at.part->name,
                    .places = {},
                    .values = {},
                    .poses = {}};
    for (const BodyShape& body : samples.bodies) {
      const auto k = at.part->shapes.find(body.name);
      to.poses.push_back(k ? std::optional(at.part->shapes.pose(*k, frame.time)) : std::nullopt);
    }
    const auto dim = static_cast<std::size_t>(frame.dim);
    for (const std::size_t p : list)
      for (std::size_t d = 0; d < 3; ++d)
        to.places.push_back(d < dim ? static_cast<float>(frame.coordinates[dim * p + d]) : 0.0F);
    for (std::size_t f = 0; f < fields.size(); ++f) {
      FrameField field = field_of(frame, fields[f]);
      to.values.emplace_back();
      for (const std::size_t p : list) {
        to.values.back().push_back(static_cast<float>(field.values[p]));
        values[f].push_back(field.values[p]);
      }
      field.values.clear();
      if (samples.fields.size() < fields.size()) samples.fields.push_back(std::move(field));
    }
    if (samples.edge == 0) samples.edge = median_edge(frame, list, at.part->axisymmetric);
    const Bounds bounds = bounds_of(frame, at.part->shapes.at(frame.time));
    if (samples.frames.empty())
      samples.bounds = bounds;
    else
      samples.bounds.add(bounds);
    samples.particles = std::max(samples.particles, frame.size());
    samples.shown = std::max(samples.shown, static_cast<Index>(list.size()));
    samples.frames.push_back(std::move(to));
  }
  for (std::vector<double>& of_field : values)
    samples.scales.push_back(scale_of(std::move(of_field)));
  return samples;
}

namespace {

/// Points as 32 bit numbers [m] from the body's centre, corners as 32 bit indices.
nlohmann::json json_of(const BodyShape& body) {
  std::string points, corners;
  const auto append_all = [&](const auto& surface) {
    for (const auto& x : surface.points)
      for (int d = 0; d < 3; ++d) {
        const double at = d < x.size() ? x[d] : 0.0;
        append(points, std::bit_cast<std::uint32_t>(
                           static_cast<float>(at - body.centre[static_cast<std::size_t>(d)])));
      }
    for (const auto& piece : surface.corners)
      for (const Local corner : piece) append(corners, static_cast<std::uint32_t>(corner));
  };
  std::visit(append_all, body.surface);
  return {{"name", body.name}, {"points", base64(points)}, {"corners", base64(corners)}};
}

/// The rows of a matrix that takes points of a body to places seen from the middle of `bounds`.
nlohmann::json json_of(const BodyPose& pose, const Bounds& bounds) {
  nlohmann::json rows = nlohmann::json::array();
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) rows.push_back(pose.axes(a, b));
    const auto d = static_cast<std::size_t>(a);
    rows.push_back(pose.place[a] - 0.5 * (bounds.low[d] + bounds.high[d]));
  }
  return rows;
}

}  // namespace

std::string json_of(const RunSamples& samples, const Bounds& bounds,
                    const std::vector<ColourScale>& scales) {
  using nlohmann::json;
  json page{{"dim", samples.dim},      {"particles", samples.particles},
            {"shown", samples.shown},  {"edge", samples.edge},
            {"low", bounds.low},       {"high", bounds.high},
            {"frames", json::array()}, {"bodies", json::array()}};
  for (const BodyShape& body : samples.bodies) page["bodies"].push_back(json_of(body));
  constexpr double most_place = 65535, most_value = 254, no_value = 255;
  for (const SampledFrame& frame : samples.frames) {
    std::string places;
    for (std::size_t k = 0; k < frame.places.size(); ++k) {
      const double low = bounds.low[k % 3], length = bounds.high[k % 3] - low;
      const double share = length > 0 ? (static_cast<double>(frame.places[k]) - low) / length : 0.5;
      append(places, static_cast<std::uint16_t>(
                         std::lround(most_place * (share >= 0 ? std::min(share, 1.0) : 0.0))));
    }
    json values = json::array();
    for (std::size_t f = 0; f < frame.values.size(); ++f) {
      std::string bytes;
      for (const float value : frame.values[f]) {
        const double share = std::clamp(scales[f].share(static_cast<double>(value)), 0.0, 1.0);
        append(bytes, static_cast<std::uint8_t>(
                          std::isfinite(value) ? std::lround(most_value * share) : no_value));
      }
      values.push_back(base64(bytes));
    }
    json poses = json::array();
    for (const auto& pose : frame.poses)
      poses.push_back(pose ? json_of(*pose, bounds) : json(nullptr));
    page["frames"].push_back({{"step", frame.step},
                              {"time", frame.time},
                              {"stage", frame.stage},
                              {"places", base64(places)},
                              {"values", std::move(values)},
                              {"poses", std::move(poses)}});
  }
  return page.dump(-1, ' ', true, json::error_handler_t::replace);
}

}  // namespace lahar
