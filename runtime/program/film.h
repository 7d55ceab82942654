/// \file A film of pictures, by ffmpeg.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

#include "io/base/atomic_file.h"

namespace lahar {

class Film {
 public:
  /// An MP4 file (H.264) that appears when it is whole. Throws InputError where ffmpeg is missing.
  Film(const std::filesystem::path& file, double pictures_per_second);
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;
  ~Film();

  void add(const std::string& png);
  /// Throws IoError with what ffmpeg says.
  void finish();

 private:
  AtomicFile file_;
  std::filesystem::path messages_;
  std::FILE* pipe_ = nullptr;
};

}  // namespace lahar
