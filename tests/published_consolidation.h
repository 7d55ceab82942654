/// \file The consolidation cases that CB-Geo's benchmarks publish (branch 2P1P-consolidation), with
/// all keys as they are written there, on coarser meshes: a saturated column of 1 m under 10 kPa.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace lahar::test {

/// The files of a case in a temporary folder, which is removed with it.
class PublishedConsolidation {
 public:
  /// `height` cells high, one cell wide; `dt` [s].
  PublishedConsolidation(int dim, int height, double dt, int nsteps)
      : dim_(dim),
        height_(height),
        folder_(std::filesystem::temp_directory_path() /
                fmt::format("lahar-consolidation-{}-{}", dim, ::getpid())) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write_mesh();
    write_particles();
    write_sets();
    write("pore-pressure-constraint.txt", "0 10000\n");
    write("mpm.json", dim == 2 ? plane(dt, nsteps) : spatial(dt, nsteps));
  }
  ~PublishedConsolidation() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  PublishedConsolidation(const PublishedConsolidation&) = delete;
  PublishedConsolidation& operator=(const PublishedConsolidation&) = delete;

  std::string file() const { return (folder_ / "mpm.json").string(); }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  // A layer of nodes after the other; the column is upright in y. An empty layer of cells is above.
  void write_mesh() const {
    const double h = 1.0 / height_;
    const int layers = height_ + 2;
    std::string text = fmt::format("{}\t{}\n", (dim_ == 2 ? 2 : 4) * layers, height_ + 1);
    for (int y = 0; y < layers; ++y)
      for (const auto& [x, z] : corners())
        text += dim_ == 2 ? fmt::format("{} {}\n", x * h, y * h)
                          : fmt::format("{} {} {}\n", x * h, y * h, z * h);
    for (int y = 0; y < height_ + 1; ++y) {
      const int n = (dim_ == 2 ? 2 : 4) * y;
      text += dim_ == 2 ? fmt::format("{} {} {} {}\n", n, n + 1, n + 3, n + 2)
                        : fmt::format("{} {} {} {} {} {} {} {}\n", n, n + 1, n + 5, n + 4, n + 3,
                                      n + 2, n + 6, n + 7);
    }
    write("mesh.txt", text);
  }
  // Of a layer of nodes: (0, 0), (1, 0), and in 3D (1, 1), (0, 1).
  std::vector<std::pair<int, int>> corners() const {
    if (dim_ == 2) return {{0, 0}, {1, 0}};
    return {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  }

  void write_particles() const {
    const double h = 1.0 / height_;
    const int per_layer = dim_ == 2 ? 2 : 4, n = per_layer * 2 * height_;
    std::string points = fmt::format("{}\n", n), pressures;
    for (int y = 0; y < 2 * height_; ++y)
      for (const auto& [x, z] : corners())
        points += fmt::format("{} {}{}\n", (0.25 + 0.5 * x) * h, (0.25 + 0.5 * y) * h,
                              dim_ == 2 ? "" : fmt::format(" {}", (0.25 + 0.5 * z) * h));
    for (int i = 0; i < n; ++i) pressures += fmt::format("{}\t10000\n", i);
    for (const char* name : {"particle.txt", "particles.txt"}) write(name, points);
    write("particle-pore-pressure.txt", pressures);
  }

  void write_sets() const {
    const int per_layer = dim_ == 2 ? 2 : 4, layers = height_ + 2;
    std::string all, base, top, loaded;
    for (int n = 0; n < per_layer * layers; ++n) all += fmt::format("{}{}", n ? ", " : "", n);
    for (int k = 0; k < per_layer; ++k) {
      const char* comma = k ? ", " : "";
      base += fmt::format("{}{}", comma, k);
      top += fmt::format("{}{}", comma, per_layer * height_ + k);
      loaded += fmt::format("{}{}", comma, per_layer * (2 * height_ - 1) + k);
    }
    // In 2D: sides and base, for each phase. In 3D: z, x, base, and what drains.
    const auto sets = dim_ == 2 ? std::vector<std::string>{all, all, base, base}
                                : std::vector<std::string>{all, all, base, top};
    std::string text = R"({"node_sets": [)";
    for (std::size_t i = 0; i < sets.size(); ++i)
      text += fmt::format(R"({}{{"id": {}, "set": [{}]}})", i ? ", " : "", i, sets[i]);
    write("entity_sets.json",
          text + fmt::format(R"(], "particle_sets": [{{"id": 1, "set": [{}]}}]}})", loaded));
  }

  static std::string plane(double dt, int nsteps) {
    return fmt::format(R"({{
  "title": "Consolidation_2D",
  "mesh": {{"mesh": "mesh.txt", "isoparametric": false, "entity_sets": "entity_sets.json",
    "cell_type": "ED2Q4", "io_type": "Ascii2D", "node_type": "N2D2P",
    "particles_pore_pressures": {{"type": "file", "location": "particle-pore-pressure.txt"}},
    "boundary_conditions": {{
      "velocity_constraints": [
        {{"nset_id": 0, "dir": 0, "velocity": 0.00}}, {{"nset_id": 1, "dir": 2, "velocity": 0.00}},
        {{"nset_id": 2, "dir": 1, "velocity": 0.00}}, {{"nset_id": 3, "dir": 3, "velocity": 0.00}}],
      "pore_pressure_constraints": [{{"file": "pore-pressure-constraint.txt"}}]}}}},
  "particles": [{{"generator": {{"check_duplicates": true, "location": "particle.txt",
    "io_type": "Ascii2D", "particle_type": "P2D2PHASE", "material_id": [0, 1], "type": "file",
    "pset_id": 0}}}}],
  "materials": [
    {{"id": 0, "name": "soil", "type": "LinearElastic2D", "density": 2600.0, "poisson_ratio": 0.3,
     "youngs_modulus": 9.80E+7, "porosity": 0.3, "k_x": 0.001, "k_y": 0.001}},
    {{"id": 1, "name": "water", "type": "Newtonian2D", "density": 1000, "bulk_modulus": 1E9,
     "mu": 0.30, "dynamic_viscosity": 0}}],
  "external_loading_conditions": {{"gravity": [0.0, 0.0],
    "particle_surface_traction": [{{"pset_id": 1, "dir": 1, "traction": -10000.0}}]}},
  "analysis": {{"type": "MPMExplicitTwoPhase2D", "stress_update": "USF",
    "free_surface_detection": {{"type": "density", "volume_tolerance": 0.25}},
    "velocity_update": false, "pore_pressure_smoothing": true, "uuid": "consolidation_2d",
    "nload_balance_steps": 25000, "gravity": [0.0, 0.0], "dt": {}, "nsteps": {},
    "resume": {{"resume": false, "uuid": "consolidation_2d", "step": 10000}}}},
  "post_processing": {{"path": "results/",
    "vtk_statevars": [{{"phase_id": 1, "statevars": ["pressure"]}}], "output_steps": 100}}
}})",
                       dt, nsteps);
  }

  static std::string spatial(double dt, int nsteps) {
    return fmt::format(R"({{
  "title": "Consolidation_3D",
  "mesh": {{"mesh": "mesh.txt", "isoparametric": false, "entity_sets": "entity_sets.json",
    "cell_type": "ED3H8", "io_type": "Ascii3D", "node_type": "N3D2P",
    "particles_pore_pressures": {{"type": "file", "location": "particle-pore-pressure.txt"}},
    "boundary_conditions": {{
      "velocity_constraints": [
        {{"nset_id": 0, "dir": 2, "velocity": 0.00}}, {{"nset_id": 0, "dir": 5, "velocity": 0.00}},
        {{"nset_id": 1, "dir": 0, "velocity": 0.00}}, {{"nset_id": 1, "dir": 3, "velocity": 0.00}},
        {{"nset_id": 2, "dir": 1, "velocity": 0.00}}, {{"nset_id": 2, "dir": 4, "velocity": 0.00}}],
      "pressure_constraints": [{{"phase_id": 1, "nset_id": 3, "pressure": 0.00}}]}}}},
  "particles": [{{"generator": {{"check_duplicates": true, "location": "particles.txt",
    "io_type": "Ascii3D", "particle_type": "P3D2PHASE", "material_id": [0, 1], "pset_id": 0,
    "type": "file"}}}}],
  "materials": [
    {{"id": 0, "name": "soil", "type": "LinearElastic3D", "density": 2600.0, "poisson_ratio": 0.3,
     "youngs_modulus": 9.80E+7, "porosity": 0.3, "k_x": 0.001, "k_y": 0.001, "k_z": 0.001}},
    {{"id": 1, "name": "water", "type": "Newtonian3D", "density": 1000, "bulk_modulus": 1E9,
     "mu": 0.30, "dynamic_viscosity": 0}}],
  "external_loading_conditions": {{"gravity": [0.0, 0.0, 0.0],
    "particle_surface_traction": [{{"pset_id": 1, "dir": 1, "traction": -10000.0}}]}},
  "analysis": {{"type": "MPMExplicitTwoPhase3D", "velocity_update": false,
    "pressure_smoothing": false, "pore_pressure_smoothing": true, "uuid": "consolidation_3d",
    "dt": {}, "nsteps": {}, "nload_balance_steps": 250000,
    "free_surface_detection": {{"type": "density", "volume_tolerance": 0.25}},
    "resume": {{"resume": false, "uuid": "consolidation_3d", "step": 10}}}},
  "post_processing": {{"path": "results/", "vtk": ["stresses"],
    "vtk_statevars": [{{"phase_id": 1, "statevars": ["pressure"]}}], "output_steps": 100}}
}})",
                       dt, nsteps);
  }

  int dim_, height_;
  std::filesystem::path folder_;
};

}  // namespace lahar::test
