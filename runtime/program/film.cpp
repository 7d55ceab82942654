#include "runtime/program/film.h"

#include <fmt/format.h>

#include <csignal>
#include <cstdlib>

#include "physics/base/error.h"
#include "runtime/program/shell_word.h"

namespace lahar {

Film::Film(const std::filesystem::path& file, double pictures_per_second)
    : file_(file), messages_(file_.temporary().string() + ".log") {
  if (std::system("command -v ffmpeg >/dev/null 2>&1") != 0)
    throw InputError({Problem{.message = "films are made with ffmpeg, which is not installed",
                              .hint = "apt-get install ffmpeg, or write pictures: --step all"}});
  std::signal(SIGPIPE, SIG_IGN);  // ffmpeg may end before us: finish() says why
  // Sizes of films are even; the pixel format is the one that all players know.
  const std::string command = fmt::format(
      "ffmpeg -y -loglevel error -f image2pipe -framerate {} -c:v png -i - "
      "-vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white' -c:v libx264 -crf 18 -preset medium "
      "-pix_fmt yuv420p -movflags +faststart -f mp4 {} 2>{}",
      pictures_per_second, shell_word(file_.temporary().string()), shell_word(messages_.string()));
  pipe_ = popen(command.c_str(), "w");
  if (!pipe_) throw IoError("cannot start ffmpeg");
}

Film::~Film() {
  if (pipe_) pclose(pipe_);
  std::error_code ignored;
  std::filesystem::remove(messages_, ignored);
}

void Film::add(const std::string& png) {
  if (std::fwrite(png.data(), 1, png.size(), pipe_) != png.size()) finish();
}

void Film::finish() {
  const int status = pclose(pipe_);
  pipe_ = nullptr;
  if (status != 0)
    throw IoError(fmt::format("cannot write {}: ffmpeg says: {}", file_.target().string(),
                              read_text_file(messages_)));
  file_.commit();
}

}  // namespace lahar
