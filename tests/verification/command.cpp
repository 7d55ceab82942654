// The command itself.
#include <doctest/doctest.h>

#include "physics/base/error.h"
#include "runtime/picture/colour_map.h"
#include "runtime/picture/svg.h"
#include "runtime/verify/verify_command.h"

using namespace lahar;

TEST_CASE("verify names the case that was meant") {
  try {
    verify_command({.name = "plate-with-hol", .output = "", .threads = 0, .published = false});
    FAIL("accepted");
  } catch (const InputError& error) {
    CHECK(
        std::string(error.what()) ==
        "there is no verification case \"plate-with-hol\". Did you mean \"plate-with-hole\"? lahar "
        "verify lists them.");
  }
}

TEST_CASE("a drawing escapes its words and clamps its colours") {
  Svg svg(10, 20);
  svg.text(1, 2, "a < b & c");
  const std::string text = svg.finish();
  CHECK(text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"10\" height=\"20\""));
  CHECK(text.find(">a &lt; b &amp; c</text>") != std::string::npos);
  CHECK(text.ends_with("</svg>\n"));
  CHECK(hex_of(viridis(-1)) == "#440154");
  CHECK(hex_of(viridis(0)) == "#440154");
  CHECK(hex_of(viridis(2)) == "#fde725");
}
