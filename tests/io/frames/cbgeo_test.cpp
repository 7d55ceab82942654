// Particle files of CB-Geo MPM: what we write, and what others wrote.
#include <doctest/doctest.h>

#include <fstream>

#include "io/base/hdf_handle.h"
#include "io/frames/cbgeo_table.h"
#include "io/results/cbgeo_export.h"
#include "io/results/export.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

namespace fs = std::filesystem;

/// Names of the members of a table's rows, in the file's order.
std::vector<std::string> field_names(const fs::path& file) {
  const HdfSession hdf(file, "read");
  const HdfHandle in = hdf.own(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  const HdfHandle data = hdf.own(H5Dopen2(in, "table", H5P_DEFAULT), H5Dclose);
  const HdfHandle type = hdf.own(H5Dget_type(data), H5Tclose);
  std::vector<std::string> names;
  for (int k = 0; k < H5Tget_nmembers(type); ++k) {
    char* name = H5Tget_member_name(type, static_cast<unsigned>(k));
    names.emplace_back(name);
    H5free_memory(name);
  }
  return names;
}

/// What another program may write: fields one after the other without gaps, in another order, in
/// single precision and with small integers, and some that nobody knows.
struct Foreign {
  std::vector<std::pair<std::string, hid_t>> fields;
  std::vector<std::vector<double>> rows;

  void write(const fs::path& file) const {
    const HdfSession hdf(file, "write");
    const HdfHandle out =
        hdf.own(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    std::size_t size = 0;
    for (const auto& [name, type] : fields) size += H5Tget_size(type);
    const std::size_t width = fields.size() * sizeof(double);
    const HdfHandle stored = hdf.own(H5Tcreate(H5T_COMPOUND, size), H5Tclose);
    const HdfHandle given = hdf.own(H5Tcreate(H5T_COMPOUND, width), H5Tclose);
    std::size_t at = 0;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const auto& [name, type] = fields[k];
      hdf.check(H5Tinsert(stored, name.c_str(), at, type));
      hdf.check(H5Tinsert(given, name.c_str(), k * sizeof(double), H5T_NATIVE_DOUBLE));
      at += H5Tget_size(type);
    }
    const hsize_t n = rows.size();
    const HdfHandle space = hdf.own(H5Screate_simple(1, &n, nullptr), H5Sclose);
    const HdfHandle data = hdf.own(
        H5Dcreate2(out, "table", stored, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
    std::vector<double> values;
    for (const auto& row : rows) values.insert(values.end(), row.begin(), row.end());
    hdf.check(H5Dwrite(data, given, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  }
};

Foreign foreign_table() {
  Foreign table;
  table.fields = {{"material_id", H5T_STD_U16BE}, {"unknown", H5T_IEEE_F32LE}};
  for (const char* name :
       {"coord_z", "coord_y", "coord_x", "velocity_x", "velocity_y", "velocity_z", "stress_xx",
        "stress_yy", "stress_zz", "tau_xy", "tau_yz", "tau_xz", "strain_xx", "strain_yy",
        "strain_zz", "gamma_xy", "gamma_yz", "gamma_xz"})
    table.fields.emplace_back(name, H5T_IEEE_F32LE);
  for (const char* name : {"volume", "mass"}) table.fields.emplace_back(name, H5T_IEEE_F64BE);
  table.fields.emplace_back("id", H5T_STD_I32LE);
  for (int i = 0; i < 3; ++i) {
    std::vector<double> row;
    for (std::size_t k = 0; k < table.fields.size(); ++k)
      row.push_back(static_cast<double>(k) + 100 * i);
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace

TEST_CASE("files are named as CB-Geo MPM names them") {
  CHECK(cbgeo_file_name(99, 1000) == "particles0099.h5");
  CHECK(cbgeo_file_name(99, 999) == "particles099.h5");
  CHECK(cbgeo_file_name(0, 1) == "particles0.h5");
  CHECK(cbgeo_file_name(12345, 0) == "particles12345.h5");
}

TEST_CASE("a frame as a table of CB-Geo MPM") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "particles9.h5";
  Frame frame = two_particles();
  frame.step = 10;
  const auto material = static_cast<Index>(frame.material.at(1));
  write_cbgeo(frame, {.nsteps = 10, .states = {{material, {"pressure"}}}}, file);
  CHECK(count_cbgeo_rows(file) == 2);
  const std::vector<CbgeoParticle> rows = read_cbgeo_rows(file, 0, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(rows[i].id == frame.id[i]);
    CHECK(rows[i].material_id == static_cast<std::uint32_t>(frame.material[i]));
    CHECK(rows[i].mass == frame.find("mass")->values[i]);
    CHECK(rows[i].volume == frame.find("volume")->values[i]);
    for (std::size_t d = 0; d < 2; ++d) {
      CHECK(rows[i].coord[d] == frame.coordinates[2 * i + d]);
      CHECK(rows[i].velocity[d] == frame.find("velocity")->values[2 * i + d]);
    }
    CHECK(rows[i].coord[2] == 0);
    for (std::size_t k = 0; k < 6; ++k)
      CHECK(rows[i].stress[k] == frame.find("stress")->values[6 * i + k]);
    CHECK(rows[i].status == 1);
    CHECK(rows[i].cell_id == -1);
  }
  CHECK(rows[1].nstate_vars == 1);
  CHECK(rows[1].svars[0] == frame.find("pressure")->values[1]);
  CHECK(rows[1].pressure == rows[1].svars[0]);

  std::vector<std::string> names{
      "id",        "mass",           "volume",         "pressure",       "coord_x",   "coord_y",
      "coord_z",   "displacement_x", "displacement_y", "displacement_z", "nsize_x",   "nsize_y",
      "nsize_z",   "velocity_x",     "velocity_y",     "velocity_z",     "stress_xx", "stress_yy",
      "stress_zz", "tau_xy",         "tau_yz",         "tau_xz",         "strain_xx", "strain_yy",
      "strain_zz", "gamma_xy",       "gamma_yz",       "gamma_xz",       "epsilon_v", "status",
      "cell_id",   "material_id",    "nstate_vars"};
  for (int k = 0; k < 20; ++k) names.push_back("svars_" + std::to_string(k));
  CHECK(field_names(file) == names);
  CHECK(names.size() == 53);  // the number that CB-Geo MPM asks for
}

TEST_CASE("a frame before the first step has no counterpart") {
  const TemporaryFolder folder;
  Frame frame = two_particles();
  frame.step = 0;
  CHECK_THROWS_WITH_AS(write_cbgeo(frame, {}, folder.path / "x.h5"),
                       "the state before the first step has no counterpart in the files of CB-Geo "
                       "MPM",
                       InputError);
}

TEST_CASE("a frame without all fields is not written with zeros in their place") {
  const TemporaryFolder folder;
  Frame frame = two_particles();
  std::erase_if(frame.columns, [](const FrameColumn& c) {
    return c.name == "mass" || c.name == "stress" || c.name == "pressure";
  });
  const fs::path file = folder.path / "x.h5";
  CHECK_THROWS_WITH_AS(write_cbgeo(frame, {}, file),
                       "the frame has no mass, stress, which the particle files of CB-Geo MPM have",
                       InputError);
  CHECK_THROWS_WITH_AS(
      write_cbgeo(frame, {.states = {{1, {"pressure"}}, {5, {"p_c"}}}}, file),
      "the frame has no mass, stress, pressure, which the particle files of CB-Geo MPM have",
      InputError);
  CHECK_FALSE(fs::exists(file));
}

TEST_CASE("a frame with a liquid in pores is not written as if it had none") {
  const TemporaryFolder folder;
  Frame frame = two_particles();
  FrameColumn pressure = *frame.find("mass");
  pressure.name = "pore_pressure";
  frame.columns.push_back(pressure);
  CHECK_THROWS_WITH_AS(write_cbgeo(frame, {}, folder.path / "x.h5"),
                       "the particle files of CB-Geo MPM have no liquid in pores: it would be lost",
                       InputError);
}

TEST_CASE("tables longer than a block, read from any row") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "particles1.h5";
  const Index n = 40000;
  write_cbgeo_table(file, n, [](Index first, Index count) {
    std::vector<CbgeoParticle> rows(static_cast<std::size_t>(count));
    for (auto& row : rows) row.id = first, row.mass = 0.5 * static_cast<double>(first++);
    return rows;
  });
  CHECK(count_cbgeo_rows(file) == n);
  const auto rows = read_cbgeo_rows(file, 16380, 10);
  for (std::size_t i = 0; i < 10; ++i) {
    CHECK(rows[i].id == 16380 + static_cast<Index>(i));
    CHECK(rows[i].mass == 0.5 * static_cast<double>(rows[i].id));
  }
}

TEST_CASE("tables of other programs: fields are found by name and converted") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "particles1.h5";
  Foreign table = foreign_table();
  table.write(file);
  const auto rows = read_cbgeo_rows(file, 1, 2);
  CHECK(rows[0].material_id == 100);
  CHECK(rows[0].coord[2] == 102);
  CHECK(rows[0].coord[0] == 104);
  CHECK(rows[1].stress[5] == 213);
  CHECK(rows[1].strain[0] == 214);
  CHECK(rows[0].mass == 121);
  CHECK(rows[1].id == 222);
  CHECK(rows[1].cell_id == -1);  // older files have none
  table.fields.erase(table.fields.begin() + 3);
  for (auto& row : table.rows) row.pop_back();
  table.write(file);
  CHECK_THROWS_WITH_AS(read_cbgeo_rows(file, 0, 1), "'table' has no numbers coord_y", InputError);
}

TEST_CASE("the files of a step are found, of one rank and of several") {
  const TemporaryFolder folder;
  for (const char* name : {"particles0010.h5", "particles-0_2-0020.h5", "particles-1_2-0020.h5",
                           "particles-0_3-0030.h5", "particles-2_3-0030.h5", "particles.h5",
                           "particles_0000000010.hdf", "stresses0010.vtp"})
    std::ofstream(folder.path / name) << "x";
  const auto names = [&](Index step) {
    std::vector<std::string> all;
    for (const auto& file : find_cbgeo_files(folder.path, step)) all.push_back(file.filename());
    return all;
  };
  using List = std::vector<std::string>;
  CHECK(names(10) == List{"particles0010.h5"});
  CHECK(names(20) == List{"particles-0_2-0020.h5", "particles-1_2-0020.h5"});
  CHECK(names(30).empty());  // rank 1 is missing
  CHECK(cbgeo_steps(folder.path) == std::vector<Index>{10, 20, 30});
  CHECK(cbgeo_steps(folder.path / "nothing").empty());
}
