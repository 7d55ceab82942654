#include "runtime/report/run_progress.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

#include "io/base/atomic_file.h"
#include "io/json/json_text.h"
#include "io/run/manifest.h"
#include "io/run/table.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// False if the process that writes is of this machine and does not exist any more.
bool may_be_alive(const json& manifest) {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0 || text_in(manifest, "host") != host.data())
    return true;
  const auto process = static_cast<pid_t>(number_in(manifest, "process"));
  return process <= 0 || kill(process, 0) == 0 || errno != ESRCH;
}

}  // namespace

double RunProgress::share() const {
  if (status == "finished") return 1;
  double most = 0;
  if (steps > 0) most = step / steps;
  if (end_time > 0) most = std::max(most, time / end_time);
  return std::clamp(most, 0.0, 1.0);
}

RunProgress read_progress(const fs::path& run) {
  const auto [folder, manifest] = folders_of_run(run).back();
  RunProgress progress;
  if (folder != run) progress.stage = folder.filename().string();
  progress.status = text_in(manifest, "status");
  progress.message = text_in(manifest, "message");
  progress.started = text_in(manifest, "started");
  progress.wall_seconds = number_in(manifest, "wall_seconds");
  if (progress.status == "running" && !may_be_alive(manifest)) progress.status = "lost";
  const json model = member_of(manifest, "model");
  progress.steps = number_in(model, "steps");
  progress.particles = number_in(model, "particles");
  std::error_code error;
  if (const fs::path file = folder / "scenario.full.json"; fs::is_regular_file(file, error))
    progress.end_time =
        number_in(member_of(json_of_text(read_text_file(file)), "analysis"), "end_time");
  if (fs::is_regular_file(folder / "history.csv", error)) {
    const Table history = read_last_row(folder / "history.csv");
    const auto last = [&](const char* column, double otherwise) {
      const TableColumn* found = history.find(column);
      return found && !found->values.empty() ? found->values.back() : otherwise;
    };
    progress.step = last("step", 0);
    progress.time = last("time", 0);
    progress.particles = last("particles", progress.particles);
    progress.max_speed = last("max_speed", 0);
  }
  return progress;
}

}  // namespace lahar
