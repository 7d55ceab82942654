#include "tests/fuzz/sections.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>

namespace lahar::fuzz {

std::vector<std::string_view> split_files(std::string_view text) {
  std::vector<std::string_view> files;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(trace_magic, 1), text.size());
    files.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return files;
}

std::vector<SectionedFile> split_sections(std::string_view text) {
  std::vector<SectionedFile> files;
  for (std::string_view file : split_files(text)) {
    if (!file.starts_with(trace_magic)) continue;
    file.remove_prefix(trace_magic.size());
    SectionedFile& sections = files.emplace_back();
    TraceSection section{};
    while (file.size() >= sizeof section) {
      std::memcpy(&section, file.data(), sizeof section);
      file.remove_prefix(sizeof section);
      const auto n = std::min<std::size_t>(section.bytes, file.size());
      sections.push_back({section.kind, std::string(file.substr(0, n))});
      file.remove_prefix(n);
    }
  }
  return files;
}

std::string join_sections(const std::vector<SectionedFile>& files) {
  std::string text;
  for (const SectionedFile& file : files) {
    text += trace_magic;
    for (const Section& section : file) {
      const TraceSection head{section.kind,
                              static_cast<std::uint32_t>(::crc32_z(
                                  0, reinterpret_cast<const unsigned char*>(section.bytes.data()),
                                  section.bytes.size())),
                              section.bytes.size()};
      text.append(reinterpret_cast<const char*>(&head), sizeof head);
      text += section.bytes;
    }
  }
  return text;
}

}  // namespace lahar::fuzz
