/// \file From a checked scenario to a Model: one member function per part.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <span>

#include "io/frames/cbgeo_table.h"
#include "io/geometry/map_files.h"
#include "io/mesh/element_file.h"
#include "io/mesh/mesh_search.h"
#include "io/scenario/material_fields.h"
#include "io/scenario/particles_generator.h"
#include "io/scenario/scenario_doubts.h"
#include "io/scenario/scenario_input.h"
#include "io/scenario/surface_faces.h"
#include "physics/geometry/solid_samples.h"
#include "physics/geometry/triangles.h"
#include "physics/materials/law.h"
#include "physics/model/model.h"

namespace lahar {

/// What a scenario says of its mesh file.
struct TableMeshKeys {
  Element element;
  bool has_ring;  ///< nodes around the cells are listed, too
  bool isoparametric;
  bool check_duplicates;
};

/// Whether a law deforms without limit only if its stress grows without one.
bool is_elastic(const Law& law);

/// Depths of all particles along gravity [m]; 0 without gravity or particles.
struct Depths {
  double mean = 0;  ///< their volume over the area of the box around them as gravity sees it
  /// What they will flow with: of columns that are higher than wide, those that fall and spread,
  /// about the root of height times width.
  double flow = 0;
};

/// Whether an object `analysis`, as it is written, is of a projection.
bool asks_for_projection(const JsonValue& analysis);

/// Builds the model part by part. A part that cannot be built is reported and left empty; the parts
/// that depend on it check what they can without it, so that one run finds every problem.
template <int Dim>
class ScenarioBuilder {
 public:
  explicit ScenarioBuilder(ScenarioInput& in);

  /// The model; meaningful only if the input has no problems.
  Model<Dim> build();

 private:
  // scenario_memory.cpp
  /// Say what is done next, which may take long.
  void phase(const std::string& text) const {
    if (in_.phase) in_.phase(text);
  }
  /// Note that this process will hold `bytes` more for `what`. Throws InputError, with the problems
  /// so far, where that is more than it may, on all members of the team: before the memory is
  /// taken. Collective.
  void need_memory(const JsonValue& at, double bytes, const std::string& what);
  /// How many more things of so many bytes each member may hold. Collective.
  Index room_for(double bytes) const;
  /// What each member will have taken with its part of so many particles more [bytes].
  double with_particles(Index count) const;
  void need_particles(const JsonValue& at, Index count);  ///< of all members; collective
  [[noreturn]] void refuse_memory(const JsonValue& at, double bytes, const std::string& what);
  // scenario_mesh.cpp
  void build_mesh();
  void check_second_order(const JsonValue& mesh);
  void build_structured_mesh(const JsonValue& mesh, const JsonValue& structured);
  void need_memory_of_grid(const JsonValue& at, Element element,
                           const std::array<Index, Dim>& counts);
  std::vector<Index> nodes_in(const Region<Dim>& region, const JsonValue& at);
  /// ids.push_back(id), as long as there is memory for it. Of this member alone.
  void add_member(std::vector<Index>& ids, Index id, const JsonValue& set);
  void build_sets();
  // scenario_mesh_file.cpp
  TableMeshKeys table_mesh_keys(const JsonValue& mesh) const;
  void build_table_mesh(const JsonValue& mesh);
  std::optional<Mesh<Dim>> read_whole_mesh(const SideFile& file, const TableMeshKeys& keys,
                                           ProblemList& problems);
  void make_grid(Element element, const Vec<Dim>& origin, const Vec<Dim>& cell,
                 const std::array<Index, Dim>& counts);
  bool read_shares(const SideFile& file, const TableMeshKeys& keys);
  void warn_of_coincident(const SideFile& file, const std::vector<Vec<Dim>>& nodes);
  std::shared_ptr<const Mesh<Dim>> mesh_with(std::vector<Index> cells) const;
  std::vector<Index> find_cells(const std::vector<Index>& suggested);
  // scenario_element_mesh.cpp
  void build_element_mesh(const JsonValue& mesh, const SideFile& file);
  void share_element_mesh(ElementMesh<Dim>& read, Index n_nodes, Index n_cells, bool isoparametric);
  TableMeshKeys element_mesh_keys(const JsonValue& mesh, Element element);
  void need_memory_of_elements(const JsonValue& at, Element element, Index nodes, Index cells);
  void take_element_sets(const ElementMesh<Dim>& read);
  void add_element_sets();
  // scenario_geometry.cpp
  void build_geometry();
  void build_shape(const std::string& name, const JsonValue& value, std::vector<std::string> users);
  Geometry<Dim> through_points(const JsonValue& value);
  Geometry<Dim> moved_surface(const JsonValue& value, const std::vector<std::string>& users);
  std::shared_ptr<const Surface<Dim>> surface_under(const JsonValue& object, std::string_view key);
  std::shared_ptr<const Surface<Dim>> surface_named(const JsonValue& name,
                                                    const std::vector<std::string>& users);
  Region<Dim> region_of(const JsonValue& value);
  // scenario_triangles.cpp
  std::optional<Triangles> read_triangles_of(const JsonValue& shape, std::string_view key);
  Geometry<Dim> from_solid(const JsonValue& shape);
  Geometry<Dim> from_triangles(const JsonValue& shape);
  void warn_of_distant_shape(const JsonValue& at, const std::pair<Vec<Dim>, Vec<Dim>>& bounds);
  // scenario_maps.cpp
  void read_map_origin();
  std::vector<MapFile> map_files(const JsonValue& names, bool whole);
  bool check_reference(const JsonValue& name, const std::string& reference);
  Geometry<Dim> from_raster(const JsonValue& names, std::string_view unit = "m");
  bool all_can(const JsonValue& at, const std::function<void()>& part);
  std::vector<float> heights_of(const Raster& raster, const Raster::Part& part,
                                const JsonValue& names);
  Geometry<Dim> from_polygons(const JsonValue& value);
  // scenario_materials.cpp
  void build_materials();
  void build_functions();
  void read_function(const JsonValue& object, MathFunction& f);
  /// Index; -1 = reported. `assigned`: particles get it; else it is only named.
  int find_material(const JsonValue& object, bool assigned = true);
  int find_function(const JsonValue& object);  ///< index; -1 = none
  // scenario_two_phase.cpp
  void saturate(int skeleton, int liquid, const JsonValue& at);
  void check_phases();     ///< after the particles
  void check_two_phase();  ///< after the analysis
  void warn_of_porosities();
  void warn_of_held_water();
  void refuse_without_liquid(const JsonValue& at);
  bool holds_both_phases(const JsonValue& object) const;
  std::optional<int> phase_direction_of(const JsonValue& object);
  void build_pore_pressures();
  void build_water_table(const JsonValue& given);
  std::optional<std::function<double(const Vec<Dim>&)>> water_level(const JsonValue& given, int up,
                                                                    int along);
  // scenario_implicit.cpp
  void build_implicit();  ///< before what depends on the scheme
  void build_implicit_steps(const JsonValue& analysis);
  void build_linear_solver(const JsonValue& analysis, std::string_view unknown);
  void check_implicit();  ///< after the analysis
  void check_implicit_conditions();
  void refuse_injection();
  /// `at` null: the analysis.
  void refuse_implicit(const JsonValue* at, const std::string& what, const std::string& hint = "");
  // scenario_projection.cpp
  void build_projection();  ///< before what depends on the scheme
  void check_projection();  ///< after the analysis
  void check_materials_of_projection();
  void choose_kept_pressure();
  /// `at` null: the analysis.
  void refuse_in_projection(const JsonValue* at, const std::string& what, const std::string& hint);
  // scenario_plane.cpp
  void build_plane();  ///< before what depends on it
  void find_axis();    ///< nodes of the axis; collective
  void hold_axis();
  void check_plane();  ///< after the analysis
  void check_axis();
  void check_sheet();          ///< of plane stress
  void clear_stress_across();  ///< of particles of sheets; collective
  /// `at` null: the analysis.
  void refuse_across(const JsonValue* at, const std::string& what, const std::string& hint);
  // scenario_b_bar.cpp
  void build_b_bar();  ///< after the analysis
  std::optional<bool> written_b_bar();
  void refuse_b_bar(const JsonValue& at);
  const JsonValue* with_particle_type(std::string_view kind) const;  ///< null: none
  void check_finite_strain();
  void warn_of_locking();
  // scenario_analysis.cpp
  void build_as_cbgeo();  ///< first of all: others depend on it
  void build_analysis();
  void build_defaults(JsonValue& analysis);
  void build_scheme(JsonValue& analysis);
  void build_stress_rate(JsonValue& analysis);
  void build_damping(const JsonValue& analysis);
  void build_shape_functions(const JsonValue& analysis);
  bool is_grid() const;  ///< collective
  void build_time_step(const JsonValue& analysis);
  void build_watchdog(JsonValue& analysis);
  void build_lost_share(JsonValue& analysis);
  // scenario_k0.cpp
  void build_k0();  ///< after gravity and pore pressures; collective
  double k0_of(const Material& material, const JsonValue& given);
  std::vector<double> k0_of_materials(const JsonValue& given);
  int vertical_of_k0(const JsonValue& given);
  /// What brings nodes along columns of a grid into balance, by particle [Pa]. Collective.
  std::vector<double> balance_of_columns(int up, const std::vector<double>& vertical,
                                         const std::vector<double>& weight) const;
  // scenario_changes.cpp
  void build_changes();  ///< of a stage, after the particles
  void assign_generator_stresses();
  ParticleGroup<Dim> group_of(const JsonValue& entry);
  void check_removal_times();
  void check_new_material(const JsonValue& at, std::uint16_t material);
  // scenario_rest.cpp
  void build_until(JsonValue& analysis);
  void check_until();  ///< after the loads
  void build_output();
  void name_output();  ///< before all that takes time
  void check_interval(const JsonValue& post, std::string_view key);
  // scenario_gauges.cpp
  void build_gauges();  ///< after the analysis and the particles; collective
  std::optional<std::vector<Index>> from_all(const std::optional<std::vector<Index>>& own);
  void build_frame_set();  ///< after the particles; collective
  void read_gauge(const JsonValue& entry);
  /// What a gauge of forces measures; false where it does not say, which was reported. Collective.
  bool read_held(const JsonValue& entry, Gauge& gauge);
  /// Those of `nodes` that conditions of this member hold along an axis of the mesh; ascending.
  std::vector<Index> held_nodes(const std::vector<Index>& nodes, int axis) const;
  void read_places(const JsonValue& entry, Gauge& gauge);
  std::vector<std::string> field_names() const;  ///< of particles, that frames may have
  void check_fields(const JsonValue& given);
  void warn_of_mixed_fields(const JsonValue& given);
  void read_node_fields(const JsonValue& given);
  void read_maps(const JsonValue& given);
  // scenario_rigid_bodies.cpp
  void build_rigid_bodies();  ///< after the functions of time
  void read_rubbing(const JsonValue& entry, RigidBody<Dim>& body);
  void read_motion(const JsonValue& entry, RigidBody<Dim>& body);
  void weigh(const JsonValue& entry, RigidBody<Dim>& body);
  void turn_around_axis(const JsonValue& entry, RigidBody<Dim>& body);
  Vec<Dim> centre_of(const SolidMoments<Dim>& moments) const;  ///< on the axis, if there is one
  bool prescribes_pressure();    ///< other than 0, at nodes; collective
  void find_pressures_inside();  ///< NodePressure::inside; after the analysis; collective
  void check_rigid_bodies();     ///< after the analysis and the particles; collective
  void check_overlap_of_bodies();
  std::pair<double, Vec<Dim>> depth_below_surface(const Solid<Dim>& solid, const Vec<Dim>& x,
                                                  double most) const;
  void find_reaches();
  void find_sides();  ///< Model::sides; scenario_sides.cpp; after the conditions; collective
  void warn_of_moving_side(const RigidBody<Dim>& side);
  void warn_of_bodies_behind(const RigidBody<Dim>& side);
  // scenario_contact.cpp
  void build_contact();
  void check_scheme_of_contact();
  void add_body(const JsonValue& body, int number);
  void number_bodies();
  // scenario_particles.cpp
  void build_particles();
  void generate(const JsonValue& generator);
  void add_particles(const JsonValue& generator, const JsonValue& owner, int material,
                     NewParticles<Dim> fresh);
  // scenario_layers.cpp
  std::optional<int> parts_of_cell(const JsonValue& generator);
  /// Whether cells that the region cuts have exact volumes, if the mesh can.
  static bool wants_exact_cuts(const JsonValue& generator, const Region<Dim>& region);
  CutCells cut_cells_of(const JsonValue& generator, const Region<Dim>& region);
  void warn_of_rounded_volume(const JsonValue& generator, const JsonValue& shape,
                              const Region<Dim>& region, const NewParticles<Dim>& made);
  NewParticles<Dim> fill_region_of(const JsonValue& generator, const Region<Dim>& region);
  void generate_layers(const JsonValue& generator, const Region<Dim>& all);
  // scenario_particles.cpp
  NewParticles<Dim> read_particles(const JsonValue& generator);
  bool check_gauss_points(const JsonValue& generator);
  NewParticles<Dim> fill_gauss(const JsonValue& generator);
  /// Gauss points of the cells of all members. Collective.
  Index gauss_count(const std::vector<Index>& cells, int n) const {
    const auto points = static_cast<Index>(gauss_points<Dim>(mesh_->element(), n).size());
    return points * team_.sum(static_cast<Index>(cells.size()));
  }
  /// fill_region() where there is memory for it (scenario_memory.cpp).
  NewParticles<Dim> fill(const JsonValue& generator, const Region<Dim>& region, int per_cell,
                         CutCells cut);
  void name_particle_set(const JsonValue& generator, Index first, Index last);
  void warn_of_coincident(const JsonValue& particles);
  void place_particles();
  void report_strays(const std::vector<Index>& strays);
  void assign_volumes();
  void assign_stresses();
  std::optional<Voigt> stress_of(const JsonValue& given, std::string_view key);
  void assign_stress(const JsonValue& given);
  /// The rows of all particles, if their number is known.
  const RowShares* known_rows() const { return particles_complete_ ? &rows_ : nullptr; }
  void collect_particle_sets();
  void build_particle_sets();
  void check_masses();  ///< scenario_masses.cpp; collective
  void assign_material_sets();
  // scenario_injection.cpp
  std::optional<std::vector<Index>> cells_of(const JsonValue& generator);
  void build_injection(const JsonValue& generator);
  void share_inflow(const JsonValue& generator, const Mesh<Dim>& mesh, Injection<Dim>& injection);
  // scenario_resume.cpp
  void build_resume();
  std::vector<std::filesystem::path> find_resume_files(const JsonValue& resume,
                                                       const std::string& run, Index step);
  void resume_from(const std::vector<std::filesystem::path>& files);
  void add_resumed(const CbgeoParticle& row, const std::string& file);
  /// Some material is of grains: gaps open in it where it is pulled apart, and it is not a fluid.
  bool any_granular() const {
    return std::any_of(model_.materials.begin(), model_.materials.end(),
                       [](const Material& m) { return can_open(m.law) && !has_pressure(m.law); });
  }
  bool all_fluids() const {
    return std::all_of(model_.materials.begin(), model_.materials.end(),
                       [](const Material& m) { return has_pressure(m.law); });
  }
  // scenario_transfer.cpp
  void build_velocity_update(const JsonValue& analysis);
  void build_transfer_rates();  ///< after the bodies
  bool is_of_elastic_bodies() const;
  std::string cell_type() const;  ///< as written; "" = not
  ShapeFunctions functions_of_cells() const;
  ShapeFunctions functions_of(const JsonValue& analysis) const;  ///< of its key, else of the cells
  std::string default_scheme(const JsonValue& analysis) const;
  void build_default_transfer();
  Depths depths() const;  ///< collective
  double speed_of(const Material& material) const;
  // scenario_conditions.cpp
  void build_conditions();  ///< of nodes
  template <class T>
  void build_condition();
  template <class T>
  void add_entry_of(const JsonValue& object);  ///< of the list of condition T
  template <class T>
  void add_set_of(const JsonValue& object, int function);
  template <class T>
  void add_file_of(const JsonValue& object, std::string_view key, int function = -1);
  template <class T>
  bool has_no_effect(const JsonValue& given);  ///< in this analysis; reported
  template <class T>
  void refuse_excluded(const JsonValue& at, std::span<const T> entries);  ///< collective
  void warn_of_two_velocities(const std::vector<std::pair<const JsonValue*, std::size_t>>& entries);
  void warn_of_absorbing_nodes(
      const std::vector<std::pair<const JsonValue*, std::size_t>>& entries);
  void join_forces();
  void integrate_accelerations();
  void split_phases();
  // scenario_loads.cpp
  void build_walls();
  void build_particle_constraints();
  void build_gravity();
  void check_other_gravity();
  // scenario_tractions.cpp
  void build_tractions();
  /// [m] edges of a particle of this member, when find_loaded_surfaces() has begun.
  Vec<Dim> edges_of(Index id) const;
  void find_loaded_surfaces();  ///< their axes, layers_of_loads_, hidden_loads_. Collective.
  /// Takes particles out that lie behind others of the traction. Collective.
  HiddenLoads leave_hidden(ParticleTraction& traction);
  /// Of several axes along which the particles are one layer, takes that along which the body ends
  /// at them. Collective.
  HiddenLoads find_strip(ParticleTraction& traction, const std::vector<int>& axes);
  void place_tractions();  ///< after warnings, which know the entries of the scenario
  /// Tractions whose particles have them at different sides, taken apart; of others nothing.
  /// Collective.
  std::vector<std::vector<ParticleTraction>> parts_by_side() const;
  // scenario_loaded_faces.cpp
  /// Cells with material in meshes that are no grids of boxes, and what load_faces() finds.
  struct LoadedFaces {
    std::shared_ptr<const Mesh<Dim>> mesh;
    std::vector<Index> filled;  ///< of this member, ascending
    /// [m^2] of particles of this member, by row: across each axis; 0 = unknown.
    std::map<Index, std::array<double, static_cast<std::size_t>(Dim)>> areas;
  };
  LoadedFaces cells_with_material() const;  ///< collective
  /// Whether the cells of loaded particles have the edges of the mean cell. Collective.
  bool has_equal_cells(const LoadedFaces& at) const;
  /// Gives a traction the area of the faces at which material ends, and takes out particles that
  /// are at none. They lie in so many layers, the least along any axis. Collective.
  HiddenLoads load_faces(ParticleTraction& traction, double layers, LoadedFaces& at) const;
  void keep_areas(const LoadedFaces& at);
  // scenario_loads_said.cpp
  double area_of(const ParticleTraction& traction) const;   ///< [m^2] of this member's particles
  bool is_per_metre() const;                                ///< loads are those of a metre of depth
  void describe_tractions(const std::vector<double>& own);  ///< by their areas [m^2]; collective
  void describe_nodal_forces();                             ///< collective
  // scenario_fields.cpp
  /// The material with one number in place of each of its fields, which become an entry of fields_;
  /// nothing where it has no fields.
  std::optional<JsonValue> take_fields(const JsonValue& material);
  void check_bounds_of(const MaterialField<Dim>& field, const JsonValue& material,
                       const JsonValue& at);
  void check_fields_known();  ///< at all particles; collective
  void refuse_fields();
  std::size_t group_of_row(Index row) const;
  void split_fields();  ///< after all that takes materials as the scenario has them; collective
  Material material_of_class(std::size_t material, Index number);
  // scenario_field_kinds.cpp
  std::optional<MaterialField<Dim>> field_of(const std::string& key, const JsonValue& given,
                                             const JsonValue& material);
  std::optional<MaterialField<Dim>> random_field(const JsonValue& given);
  std::optional<MaterialField<Dim>> profile(const JsonValue& given);
  std::optional<MaterialField<Dim>> mapped(const JsonValue& given, std::string_view unit);
  std::optional<std::function<double(const Vec<Dim>&)>> level_of(const JsonValue& given);
  // scenario_marks.cpp
  void collect_marks();  ///< for a picture, where one is wanted
  template <class List>
  void mark_entries(const JsonValue& where, const List& list);
  void mark_water();
  // scenario_doubts.cpp
  void warn_of_doubts();  ///< last of all, where the input has no problems; collective
  void warn_of_weak_materials();
  void warn_of_angles();
  void warn_of_steep_friction();
  void warn_of_free_fall();
  void warn_of_smoothing();
  void warn_of_fields();
  // scenario_doubts_places.cpp
  void warn_of_walls();
  void warn_of_side(const JsonValue& entry, const double* low, const double* high, int axis,
                    int outward);
  void warn_of_missing_top(const JsonValue& generator, const Region<Dim>& all,
                           const std::vector<Region<Dim>>& tops);
  void warn_of_clipping(const JsonValue& shape, const Region<Dim>& region, Index particles);
  using Box = std::array<Vec<Dim>, 2>;  ///< its lowest and highest corner [m]
  /// Around the particles of each generator; none where there is but one. Collective.
  std::vector<Box> generator_boxes() const;
  /// visit(generator, position) of all particles that this member holds, in their order.
  template <class Visit>
  void for_own_particles(const Visit& visit) const {
    std::size_t g = 0;
    for (const RowShares::Range& range : rows_.own_ranges())
      for (Index row = range.first; row < range.end; ++row) {
        while (row >= generators_[g].end) ++g;
        visit(g, static_cast<std::size_t>(range.local + row - range.first));
      }
  }
  void warn_of_overlap(const std::vector<Box>& boxes);
  void warn_of_thick_loads();
  void warn_of_lost_foundations();
  void warn_of_rough_fields();
  /// Whether boxes are further from each other than `gap` along an axis.
  static bool apart(const Box& a, const Box& b, const Vec<Dim>& gap);
  // scenario_doubts_units.cpp
  void warn_of_units();
  void warn_of_falling_bodies();
  std::vector<Box> boxes_of_generators() const;  ///< of all; collective
  void warn_of_few_particles();
  void warn_of_stiff_materials();
  void warn_of_viscous_steps();
  std::vector<double> pressures_at_ground();  ///< [Pa] of water in pores; collective
  void warn_of_missing_loads();
  void warn_of_stresses_beyond_strength();
  // scenario_doubts_gravity.cpp
  void warn_of_gravity_upward();
  void warn_of_gravity_across(const JsonValue& gravity);
  void warn_of_small_strength();
  void warn_of_distant_gauges();
  void warn_of_open_sides();
  void warn_of_distant_bodies();
  void warn_of_fast_bodies();
  void warn_of_idle_gauges();
  void warn_of_no_load();
  // scenario_doubts_maps.cpp
  std::string mesh_extent(int axes) const;  ///< where the mesh lies along its first axes, as text
  void warn_of_distant_maps();
  void warn_of_fine_maps();
  void warn_of_short_terrain();
  void warn_of_holes();
  void warn_of_cut_polygons();
  // scenario_doubts_rows.cpp
  /// The `places` (this member's) inside of a structured mesh whose neighbours along their axis are
  /// not in the row. Collective.
  std::vector<Index> thin_rows(const std::vector<Index>& places,
                               const std::function<bool(Index)>& is_in_row) const;
  /// The places of `thin` with particles in a cell around them. Ascending; collective.
  std::vector<Index> rows_in_material(const std::vector<Index>& thin) const;
  void warn_of_thin_supports();
  // scenario_doubts_loads.cpp
  void warn_of_lost_loads();
  void warn_of_forces_on_nothing();
  double first_step();  ///< [s] as the run takes it; collective
  void warn_of_pushing_nodes();
  void warn_of_free_inflow();
  // scenario_doubts_volumes.cpp
  void warn_of_missing_volumes();  ///< before particles without a volume get theirs; collective
  void warn_of_partly_filled_cells(const std::vector<bool>& is_file);
  void warn_of_large_volumes();
  void warn_of_shallow_liquids();
  void warn_of_small_gauges();
  // scenario_doubts_bodies.cpp
  bool decides_on_contact() const;  ///< by `interface`, or as CB-Geo MPM
  void warn_of_bonds();
  void warn_of_distance(const std::vector<Box>& boxes);
  void warn_of_stillness();
  void warn_of_no_pressure();
  void warn_of_softening();
  void warn_of_thin_layers();
  void warn_of_stiffness_contrast();
  // scenario_doubts_thin.cpp
  void warn_of_thin_bodies();
  // scenario_doubts_places.cpp
  std::vector<Vec<Dim>> places_of(const std::vector<Index>& nodes) const;  ///< collective
  Vec<Dim> outer_cell() const;  ///< [m] edges of a cell, or of the boxes around them in the mean
  bool is_held(Index node, int dir) const;
  // scenario_loads.cpp
  /// The ids that `id_key` or `name_key` of an object mean, ascending (-1 = all of them); nothing
  /// if reported. Those that this member of the team has: nodes of directory_rank(), particles it
  /// holds.
  std::optional<std::vector<Index>> members(const JsonValue& object, std::string_view id_key,
                                            std::string_view name_key, const EntitySets& sets);
  std::optional<std::vector<Index>> members_of(const JsonValue& value, const EntitySets& sets);
  /// Whether these keys mean all particles (-1), those that are still to come too.
  static bool means_all(const JsonValue& object, std::string_view id_key,
                        std::string_view name_key);
  std::optional<int> direction_of(const JsonValue& object);
  /// Report keys that a `file` entry replaces or that are missing without one; true = use the file.
  bool from_file(const JsonValue& object, const std::vector<std::string_view>& required);
  /// True, with a warning, where constraints are the name of a file, as they were in older cases.
  bool is_file_name(std::string_view constraints);

  /// Set a key of an object, for scenario.full.json.
  static void set(JsonValue& object, std::string_view key, auto value) {
    auto& members = std::get<JsonValue::Object>(object.data);
    auto it =
        std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.key == key; });
    if (it == members.end()) it = members.insert(it, {std::string(key), object.offset, {}});
    it->value.data = std::move(value);
  }
  const JsonValue& section(std::string_view key) const {
    const JsonValue* v = root_.find(key);
    return v && v->is<JsonValue::Object>() ? *v : empty_;
  }
  const JsonValue& boundary() const {
    const JsonValue* v = section("mesh").find("boundary_conditions");
    return v ? *v : empty_;
  }
  Index n_nodes() const { return model_.mesh ? model_.mesh->n_nodes() : -1; }
  Index n_cells() const {
    return !model_.mesh ? -1 : listed_cells_ >= 0 ? listed_cells_ : model_.mesh->n_cells();
  }

  ScenarioInput& in_;
  const Team& team_;
  JsonValue& root_;
  JsonValue empty_;
  Model<Dim> model_;
  std::shared_ptr<const Mesh<Dim>> mesh_;  ///< of a team and from tables, a share
  std::vector<Vec<Dim>> own_nodes_;        ///< [m] with a share: Team::part() of the nodes
  std::optional<MeshSearch<Dim>> search_;  ///< until the particles have their cells
  EntityFile sets_;
  /// A group of a mesh file, with the members that this one keeps.
  struct ElementSet {
    bool nodes;  ///< else cells
    std::string name;
    Index id;  ///< where it has no name
    std::vector<Index> members;
  };
  std::vector<ElementSet> element_sets_;  ///< until build_sets()
  std::vector<Index> axis_nodes_;  ///< of axisymmetric models, that this member keeps; ascending
  Index listed_cells_ = -1;      ///< those of a mesh file that has nodes around them, too; -1 = all
  double region_tolerance_ = 0;  ///< [m]
  Geometries<Dim> geometry_;
  std::string map_file_;                ///< the first that says its coordinate reference system
  std::set<std::string> said_of_maps_;  ///< what was wrong with their files
  double memory_ = 0;                   ///< [bytes] noted by need_memory()
  static constexpr double member_bytes = 2 * sizeof(Index);  ///< of a set, with room to grow
  RowShares rows_;                                           ///< of model_.particles: who has which
  Index placed_row_ = std::numeric_limits<Index>::max();     ///< first of a generator of a stage
  bool particles_complete_ = true;    ///< false: some generator failed, the number is not known
  std::optional<double> relaxation_;  ///< [-] of velocities, by the wave speed
  std::optional<double> relaxation_time_;                 ///< [s]
  std::optional<double> viscosity_;                       ///< [m^2/s] of velocities
  std::optional<double> viscosity_length_;                ///< [m] of grains
  bool default_transfer_ = false;                         ///< nothing is written about the transfer
  bool moving_ = false;                                   ///< some generator gave a velocity
  std::map<int, int> liquids_;                            ///< by material: the one in its pores
  std::vector<std::pair<int, const JsonValue*>> single_;  ///< uses of materials without a liquid
  std::set<Index> generator_sets_;  ///< particle set ids that a generator made
  std::set<Index> shadowed_sets_;   ///< of those: also in entity_sets.json, with other members
  /// A file of positions and its rows, for the line numbers of particles outside the mesh.
  struct Source {
    SideFile file;
    Index first, last;
  };
  std::vector<Source> sources_;
  std::vector<GeneratorRows> generators_;  ///< that gave particles, in their order
  bool of_boxes_ = false;                  ///< particles are boxes like their cells
  std::vector<double> layers_of_loads_;    ///< of particles behind each other, by traction
  std::vector<HiddenLoads> hidden_loads_;  ///< by traction
  std::vector<FrictionEntry> friction_entries_;
  std::vector<std::vector<MaterialField<Dim>>> fields_;  ///< of each material of the scenario
};

}  // namespace lahar
