/// \file Inputs of several files, each of sections with checksums, as traces are. A change of a
/// section comes with the right checksum: what is behind it would be read by nobody else.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/trace/record/record.h"

namespace lahar::fuzz {

struct Section {
  TraceSection::Kind kind;
  std::string bytes;
};
using SectionedFile = std::vector<Section>;

/// Files that follow each other, each beginning with trace_magic; what is not whole is left out.
std::vector<SectionedFile> split_sections(std::string_view text);
std::string join_sections(const std::vector<SectionedFile>& files);

/// The texts of the files, as they are.
std::vector<std::string_view> split_files(std::string_view text);

}  // namespace lahar::fuzz
