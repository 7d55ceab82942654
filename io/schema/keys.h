/// \file The key tables: one row per key of the input. They drive parsing, bounds checks,
/// "did you mean", defaults, the JSON Schema and the reference page.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "io/json/json_source.h"

namespace lahar {

/// What a value may be; a key may allow several.
enum Kind : unsigned {
  boolean = 1u << 0,
  integer = 1u << 1,  ///< 12 or 1.2E+1
  number = 1u << 2,   ///< finite
  text = 1u << 3,
  file = 1u << 4,              ///< name of a file, relative to the scenario's folder
  vector = 1u << 5,            ///< one number per dimension
  cell_counts = 1u << 6,       ///< one integer per dimension
  numbers = 1u << 7,           ///< numbers, any length
  texts = 1u << 8,             ///< array of text
  object = 1u << 9,            ///< of Field::section
  list = 1u << 10,             ///< array of objects of Field::section
  map = 1u << 11,              ///< object: names of the user's choice -> objects of Field::section
  id = 1u << 12,               ///< integer id, or a name
  ids = 1u << 13,              ///< array of ids or names
  direction = 1u << 14,        ///< 0, 1, 2 or "x", "y", "z"
  points = 1u << 15,           ///< array of points in the plane
  phase_direction = 1u << 16,  ///< direction, or one of the liquid in pores: dim and above
  places = 1u << 17,           ///< array of points, one number per dimension each
  any = 1u << 18,              ///< checked elsewhere, or refused whatever they hold
};

enum class Support {
  yes,
  planned,  ///< part of the format, refused with "is not supported yet"
  ignored,  ///< accepted with a warning: the reference ignores it too
  older,    ///< of input that the reference no longer reads: refused, KeySpec::help says what to
            ///< write
};

struct Section;

/// One key of a section.
struct KeySpec {
  std::string_view key;
  unsigned kinds;
  std::string_view help;
  std::string_view unit = "";
  std::string_view fallback = "";     ///< default, as JSON; empty = none
  std::string_view fallback_3d = "";  ///< default in 3D where it differs
  bool required = false;
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;                      ///< the lower bound itself is not allowed
  bool below_max = false;                      ///< the upper bound itself is not allowed
  std::vector<std::string_view> allowed = {};  ///< values of a text
  std::vector<std::string_view> planned = {};  ///< values that are not supported yet
  unsigned planned_kinds = 0;                  ///< kinds of value that are not supported yet
  Support support = Support::yes;
  std::string_view instead = "";            ///< where this key is there, an older one is ignored
  const Section& (*section)() = nullptr;    ///< of object, list and map
  std::vector<std::string_view> only = {};  ///< values of the discriminator that have this key
  bool native = false;                      ///< Lahar's own, not in the CB-Geo format
  /// True if it may be in an object with this value of the discriminator.
  bool applies(std::string_view variant) const;
};

/// The keys of one kind of object.
struct Section {
  std::string_view name;  ///< in messages: "analysis", "a material"
  std::string_view path;  ///< heading in the reference: "materials[]"
  std::string_view help;
  std::string_view discriminator = "";  ///< key that says which variant this is
  std::vector<KeySpec> keys;
  bool dimension_suffix = false;  ///< the discriminator's values may end in 2D or 3D
  /// The row of a key; of several the one that applies to this value of the discriminator, or else
  /// the first. Null if there is none.
  const KeySpec* find(std::string_view key, std::string_view variant = "") const;
};

const Section& scenario_section();
const Section& mesh_section();
const Section& boundary_section();
/// Keys of the conditions of nodes in the table: loads, or those of boundary_section().
std::vector<KeySpec> condition_keys(bool loads);
const Section& particles_section();
const Section& generator_section();
const Section& materials_section();
const Section& loading_section();
const Section& function_section();
const Section& material_set_section();
const Section& sets_section();
const Section& region_section();
const Section& rigid_body_section();
const Section& geometry_section();
const Section& analysis_section();
const Section& scheme_settings_section();
const Section& linear_solver_section();
const Section& post_processing_section();
const Section& gauge_section();
const Section& maps_section();
const Section& stage_section();
const Section& at_start_section();
const Section& driver_section();  ///< not of a scenario: of `lahar material`
const Section& path_section();
/// The largest strain of a segment, and of one of its increments [-].
inline constexpr double largest_path_strain = 10;

/// Every section that the scenario reaches, each once, in reading order.
std::vector<const Section*> all_sections();

/// Check `object` against its table, report every problem, mark bad values invalid and fill in the
/// defaults. `dim` is 2 or 3.
void check_section(const Section& section, JsonValue& object, int dim, JsonDocument& document,
                   ProblemList& problems);

/// A text without its trailing 2D or 3D.
std::string_view without_dimension(std::string_view type);

/// `a number [s]`, `true or false`, ...: what a value may be, in words; dim 0: for any dimension.
std::string allowed_kinds(const KeySpec& spec, int dim = 0);

std::string section_schema(const Section& section);     ///< JSON Schema of its objects
std::string section_reference(const Section& section);  ///< its heading, help and table in Markdown

std::string scenario_schema();     ///< JSON Schema of the input, from the key tables
std::string scenario_reference();  ///< Markdown reference of the input, from the key tables

}  // namespace lahar
