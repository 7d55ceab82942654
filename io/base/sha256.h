/// \file SHA-256 (FIPS 180-4), so that a manifest says which input a result belongs to.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace lahar {

/// SHA-256 of a file as 64 hexadecimal digits (as sha256sum prints). Throws IoError.
std::string sha256_of_file(const std::filesystem::path& file);
/// SHA-256 of a text.
std::string sha256(std::string_view text);

}  // namespace lahar
