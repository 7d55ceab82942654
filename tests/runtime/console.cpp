#include "runtime/console.h"

#include <doctest/doctest.h>

using namespace lahar;

// An adaptive run may take more steps than its first one promised.
TEST_CASE("the bar is full at the end and stays full beyond it") {
  const std::string empty(40, ' '), half = std::string(20, '=') + std::string(20, ' '),
                                    full(40, '=');
  CHECK(progress_bar(0, 1e6) == "  [" + empty + "]   0 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(0.5, 1e6) == "  [" + half + "]  50 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(1, 1e6) == "  [" + full + "] 100 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(1.7, 1e6) == progress_bar(1, 1e6));
  CHECK(progress_bar(-1, 1e6) == progress_bar(0, 1e6));
}

TEST_CASE("counts have separators, times the unit that suits them") {
  CHECK(format_count(7) == "7");
  CHECK(format_count(40155) == "40,155");
  CHECK(format_count(-1234567) == "-1,234,567");
  CHECK(format_seconds(3.14159) == "3.1 s");
  CHECK(format_seconds(125) == "2 min 05 s");
  CHECK(format_seconds(7260) == "2 h 01 min");
  CHECK(format_bytes(512) == "512 B");
  CHECK(format_bytes(1.5 * 1024 * 1024) == "1.5 MiB");
}
