#include "io/base/memory_limit.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "io/base/text.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

constexpr double no_limit = std::numeric_limits<double>::infinity();

/// Version 1 says that there is no limit by a number like this or larger [bytes].
constexpr double unlimited = 0x1p60;

double number_in(const fs::path& file) {
  std::ifstream in(file);
  double bytes = 0;
  if (!(in >> bytes) || bytes <= 0 || bytes >= unlimited) return no_limit;  // "max" is no number
  return bytes;
}

/// The least of the numbers in files `name` in a folder below `root` and in all around it.
double least_around(const fs::path& root, fs::path group, const char* name) {
  double least = no_limit;
  for (group = group.relative_path();; group = group.parent_path()) {
    least = std::min(least, number_in(root / group / name));
    if (group.empty()) return least;
  }
}

double machine_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

double group_limit(const fs::path& root, std::string_view groups) {
  double least = no_limit;
  std::istringstream lines{std::string(groups)};
  for (std::string line; std::getline(lines, line);) {  // number:controllers:path
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const std::string path = line.substr(second + 1);
    if (controllers == ",,") least = std::min(least, least_around(root, path, "memory.max"));
    if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, least_around(root / "memory", path, "memory.limit_in_bytes"));
  }
  return least;
}

MemoryLimit memory_limit(double wanted, int processes) {
  const double machine = machine_memory();
  const double group = group_limit("/sys/fs/cgroup", text_of("/proc/self/cgroup"));
  MemoryLimit limit;
  const double all = wanted > 0 ? wanted : std::min(machine, group);
  limit.source = wanted > 0        ? fmt::format("--memory allows {}", format_bytes(all))
                 : group < machine ? fmt::format("its control group allows {}", format_bytes(all))
                                   : fmt::format("this machine has {}", format_bytes(all));
  limit.bytes = all / processes;
  if (processes > 1)
    limit.source +=
        fmt::format(", {} for each of {} ranks on it", format_bytes(limit.bytes), processes);
  rlimit address_space{};
  if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY &&
      static_cast<double>(address_space.rlim_cur) < limit.bytes) {
    limit.bytes = static_cast<double>(address_space.rlim_cur);
    limit.source = fmt::format("a process may take {} (ulimit -v)", format_bytes(limit.bytes));
  }
  return limit;
}

double bytes_of(const std::string& text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, number);
  while (rest < end && *rest == ' ') ++rest;
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  double factor = unit.empty() || unit == "B" ? 1 : 0;
  for (const char* const letters = "KMGT"; const char letter : std::string_view(letters)) {
    const double size =
        std::pow(1024.0, static_cast<double>(std::strchr(letters, letter) - letters) + 1);
    for (const char* const tail : {"", "B", "iB"})
      if (unit == letter + std::string(tail)) factor = size;
  }
  if (error != std::errc{} || factor == 0 || !(number > 0) || !std::isfinite(number * factor))
    throw InputError({Problem{.message = fmt::format("'{}' is not a size of memory", text),
                              .hint = "give a number and K, M, G or T, such as 64G or 500M"}});
  return number * factor;
}

Problem too_much_memory(double bytes, std::string_view what, const MemoryLimit& limit) {
  return {.message = fmt::format("{} of memory are needed for {}; {}", format_bytes(bytes), what,
                                 limit.source),
          .hint =
              "take larger cells, a smaller region or fewer particles per cell, or more machines "
              "(mpirun); --memory SIZE if there is more"};
}

}  // namespace lahar
