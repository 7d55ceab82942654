#include "io/base/series.h"

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"

namespace lahar {

// File names here are made by this program and need no escaping.

void write_series(const std::vector<TimedFile>& files, const std::filesystem::path& file) {
  std::string text = "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [";
  const char* separator = "\n";
  for (const TimedFile& entry : files) {
    text += separator;
    text += "    {\"name\": \"" + entry.name + "\", \"time\": ";
    append_number(text, entry.time);
    text += '}';
    separator = ",\n";
  }
  write_text_file(file, text + "\n  ]\n}\n");
}

void write_pvd(const std::vector<TimedFile>& files, const std::filesystem::path& file) {
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
      "  <Collection>\n";
  for (const TimedFile& entry : files) {
    text += "    <DataSet timestep=\"";
    append_number(text, entry.time);
    text += "\" part=\"0\" file=\"" + entry.name + "\"/>\n";
  }
  write_text_file(file, text + "  </Collection>\n</VTKFile>\n");
}

}  // namespace lahar
