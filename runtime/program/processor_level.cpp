#include "runtime/program/processor_level.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace lahar {

#if defined(LAHAR_PORTABLE) && defined(__x86_64__)

namespace {

namespace fs = std::filesystem;

/// Levels of the x86-64 psABI that this processor has, the best first.
bool has_v3() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}

bool has_v4() {
  return has_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}

}  // namespace

void become_best_level(char** argv) {
  std::error_code error;
  const fs::path own = fs::read_symlink("/proc/self/exe", error);
  if (error) return;
  const char* wish = std::getenv("LAHAR_LEVEL");
  const std::string wanted = wish ? wish : "";
  const fs::path folder = own.parent_path().parent_path() / "libexec" / "lahar";
  for (const auto& [level, runs] : {std::pair{"x86-64-v4", has_v4()}, {"x86-64-v3", has_v3()}}) {
    const fs::path program = folder / level / "lahar";
    if (runs && (wanted.empty() || wanted == level) && ::access(program.c_str(), X_OK) == 0)
      ::execv(program.c_str(), argv);  // returns only where it fails: then this one does
  }
}

#else

void become_best_level(char**) {}

#endif

}  // namespace lahar
