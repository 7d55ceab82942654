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
  if (!is_run_folder(run)) return facts;
  const auto manifest = json_of_text(read_text_file(run / "manifest.json"));
  if (manifest.is_object() && manifest.contains("title") && manifest["title"].is_string())
    facts.title = manifest["title"].get<std::string>();
  if (!fs::exists(run / "scenario.full.json")) return facts;
  const auto scenario = json_of_text(read_text_file(run / "scenario.full.json"));
  if (!scenario.is_object() || !scenario.contains("analysis")) return facts;
  const auto& analysis = scenario["analysis"];
  facts.axisymmetric =
      analysis.is_object() && analysis.contains("plane") && analysis["plane"] == "axisymmetric";
  return facts;
}

}  // namespace lahar
