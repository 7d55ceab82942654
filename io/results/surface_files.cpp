// Triangles as STL and VTP files.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string>

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"
#include "io/results/free_surface.h"

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

void write_vtp(const Triangles& triangles, double time, const std::filesystem::path& file) {
  const std::size_t points = triangles.points.size(), count = triangles.corners.size();
  std::string data;  // each array behind its size
  std::string offsets[3];
  const auto begin = [&](std::size_t k, std::size_t bytes) {
    append_number(offsets[k], static_cast<Index>(data.size()));
    append_bytes(data, static_cast<std::uint64_t>(bytes));
  };
  begin(0, points * 3 * sizeof(double));
  for (const Vec<3>& x : triangles.points)
    for (int d = 0; d < 3; ++d) append_bytes(data, x[d]);
  begin(1, count * 3 * sizeof(std::int64_t));
  for (const auto& corners : triangles.corners)
    for (const Local corner : corners) append_bytes(data, static_cast<std::int64_t>(corner));
  begin(2, count * sizeof(std::int64_t));
  for (std::size_t k = 1; k <= count; ++k) append_bytes(data, static_cast<std::int64_t>(3 * k));
  std::string when;
  append_number(when, time);
  write_text_file(file, fmt::format(R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData><FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">
{}</DataArray></FieldData>
<Piece NumberOfPoints="{}" NumberOfPolys="{}">
<Points><DataArray type="Float64" NumberOfComponents="3" format="appended" offset="{}"/></Points>
<Polys><DataArray type="Int64" Name="connectivity" format="appended" offset="{}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{}"/></Polys>
</Piece></PolyData>
<AppendedData encoding="raw">_)",
                                    when, points, count, offsets[0], offsets[1], offsets[2]) +
                            data + "</AppendedData></VTKFile>\n");
}

}  // namespace lahar
