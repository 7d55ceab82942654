#include "runtime/picture/run_facts.h"

#include "io/base/atomic_file.h"
#include "io/json/json_text.h"
#include "io/run/manifest.h"

namespace lahar {

RunFacts run_facts(const std::filesystem::path& source) {
  namespace fs = std::filesystem;
  const fs::path run =
      fs::is_directory(source) ? source : fs::absolute(source).parent_path().parent_path();
  RunFacts facts;
  const auto manifest = read_manifest(run);
  if (!manifest) return facts;
  facts.title = text_in(*manifest, "title");
  facts.axisymmetric = is_axisymmetric(run);
  facts.bodies = PlacedBodies(run);
  return facts;
}

bool is_axisymmetric(const std::filesystem::path& run) {
  const std::filesystem::path file = run / "scenario.full.json";
  if (!std::filesystem::exists(file)) return false;
  return text_in(member_of(json_of_text(read_text_file(file)), "analysis"), "plane") ==
         "axisymmetric";
}

}  // namespace lahar
