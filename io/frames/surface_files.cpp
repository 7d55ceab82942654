#include "io/frames/surface_files.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

template <class T>
void append_bytes(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void write_stl(const Triangles& triangles, const std::filesystem::path& file) {
  std::string bytes = "free surface";
  bytes.resize(80, ' ');
  append_bytes(bytes, static_cast<std::uint32_t>(triangles.corners.size()));
  const auto append = [&](const Vec<3>& x) {
    for (int d = 0; d < 3; ++d) append_bytes(bytes, static_cast<float>(x[d]));
  };
  for (Index t = 0; t < static_cast<Index>(triangles.corners.size()); ++t) {
    append(triangles.area_vector(t).stableNormalized());
    for (int corner = 0; corner < 3; ++corner) append(triangles.point(t, corner));
    append_bytes(bytes, std::uint16_t{0});
  }
  write_text_file(file, bytes);
}

namespace {

/// What cells are in a VTK file of dimension `Dim`.
template <int Dim>
constexpr const char* cells_name = Dim == 2 ? "Lines" : "Polys";

/// The number behind `NAME="` in the head of a file; none where it is not there.
std::optional<std::size_t> number_behind(std::string_view head, const std::string& name) {
  const std::size_t at = head.find(name + "=\"");
  if (at == head.npos) return {};
  std::size_t number = 0;
  const char* begin = head.data() + at + name.size() + 2;
  if (std::from_chars(begin, head.data() + head.size(), number).ec != std::errc{}) return {};
  return number;
}

}  // namespace

template <int Dim>
void write_vtp(const LevelSurface<Dim>& surface, double time, const std::filesystem::path& file) {
  const std::size_t points = surface.points.size(), count = surface.corners.size();
  std::string data;  // each array behind its size
  std::string offsets[3];
  const auto begin = [&](std::size_t k, std::size_t bytes) {
    append_number(offsets[k], static_cast<Index>(data.size()));
    append_bytes(data, static_cast<std::uint64_t>(bytes));
  };
  begin(0, points * 3 * sizeof(double));
  for (const Vec<Dim>& x : surface.points)
    for (int d = 0; d < 3; ++d) append_bytes(data, d < Dim ? x[d] : 0.0);
  begin(1, count * Dim * sizeof(std::int64_t));
  for (const auto& corners : surface.corners)
    for (const Local corner : corners) append_bytes(data, static_cast<std::int64_t>(corner));
  begin(2, count * sizeof(std::int64_t));
  for (std::size_t k = 1; k <= count; ++k) append_bytes(data, static_cast<std::int64_t>(Dim * k));
  std::string when;
  append_number(when, time);
  write_text_file(file, fmt::format(R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData><FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">
{}</DataArray></FieldData>
<Piece NumberOfPoints="{}" NumberOf{}="{}">
<Points><DataArray type="Float64" NumberOfComponents="3" format="appended" offset="{}"/></Points>
<{}><DataArray type="Int64" Name="connectivity" format="appended" offset="{}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{}"/></{}>
</Piece></PolyData>
<AppendedData encoding="raw">_)",
                                    when, points, cells_name<Dim>, count, offsets[0],
                                    cells_name<Dim>, offsets[1], offsets[2], cells_name<Dim>) +
                            data + "</AppendedData></VTKFile>\n");
}

template <int Dim>
LevelSurface<Dim> read_vtp(const std::filesystem::path& file) {
  const std::string text = read_text_file(file);
  const auto refuse = [&]() {
    throw IoError(fmt::format("cannot read {}: not a surface of a rigid body", file.string()));
  };
  constexpr std::string_view mark = "<AppendedData encoding=\"raw\">_";
  const std::size_t end = text.find(mark);
  if (end == text.npos) refuse();
  const std::string_view head = std::string_view(text).substr(0, end);
  const auto points = number_behind(head, "NumberOfPoints");
  const auto count = number_behind(head, std::string("NumberOf") + cells_name<Dim>);
  if (!points || !count) refuse();
  constexpr std::size_t size = sizeof(std::uint64_t), most = std::size_t{1} << 32;
  const std::string_view data = std::string_view(text).substr(end + mark.size());
  if (*points > most || *count > most ||
      data.size() < 2 * size + 3 * size * *points + size * Dim * *count)
    refuse();
  LevelSurface<Dim> surface;
  const char* from = data.data() + size;
  for (std::size_t p = 0; p < *points; ++p, from += 3 * sizeof(double)) {
    surface.points.emplace_back();
    std::memcpy(surface.points.back().data(), from, Dim * sizeof(double));
  }
  from += size;
  for (std::size_t c = 0; c < *count; ++c) {
    auto& corners = surface.corners.emplace_back();
    for (Local& corner : corners) {
      std::int64_t id = 0;
      std::memcpy(&id, from, sizeof id);
      from += sizeof id;
      if (id < 0 || id >= static_cast<std::int64_t>(*points)) refuse();
      corner = static_cast<Local>(id);
    }
  }
  return surface;
}

template void write_vtp<2>(const Lines&, double, const std::filesystem::path&);
template void write_vtp<3>(const Triangles&, double, const std::filesystem::path&);
template Lines read_vtp<2>(const std::filesystem::path&);
template Triangles read_vtp<3>(const std::filesystem::path&);

}  // namespace lahar
