/// \file How much memory a process may take, and what is said where a case needs more.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

#include "physics/base/error.h"

namespace lahar {

struct MemoryLimit {
  double bytes = std::numeric_limits<double>::infinity();  ///< [bytes] of this process
  std::string source = {};  ///< where that comes from: "this machine has 23.4 GiB"
};

/// The limit of one of `processes` that share this machine equally. `wanted` [bytes]: of the
/// machine, instead of what it has; 0 = its memory, or less where control groups allow less. Where
/// the process alone is limited (ulimit -v), the smaller counts.
MemoryLimit memory_limit(double wanted, int processes);

/// What control groups allow [bytes]: the least of the groups that `groups`, the text of
/// /proc/self/cgroup, names and of those around them, below `root` (/sys/fs/cgroup); versions 1
/// and 2. Infinite where nothing is said.
double group_limit(const std::filesystem::path& root, std::string_view groups);

/// The bytes that "64G", "500M", "1.5 TiB" or "65536" mean: K, M, G and T are powers of 1024.
/// Throws InputError.
double bytes_of(const std::string& text);

/// The problem of something that would take `bytes` where there is less: "3.4 GiB of memory are
/// needed for WHAT; ...". Where to place it is for the caller.
Problem too_much_memory(double bytes, std::string_view what, const MemoryLimit& limit);

}  // namespace lahar
