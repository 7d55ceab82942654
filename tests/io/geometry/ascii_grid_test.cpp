// Texts of ESRI ASCII grids that GDAL would read as something else.
#include "io/geometry/ascii_grid.h"

#include <doctest/doctest.h>

#include <string>

#include "physics/base/error.h"
#include "tests/io/base/team_folder.h"

using namespace lahar;

namespace {

const std::string head =
    "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9999\n";

/// What is said of a file with this text.
std::string said(const std::string& text) {
  const Folder folder;
  folder.write("a.asc", text);
  try {
    check_ascii_grid({"a.asc", (folder.path / "a.asc").string()});
  } catch (const InputError& e) {
    return e.problems()[0].message;
  }
  return "";
}

}  // namespace

TEST_CASE("grids of numbers pass, however they are written") {
  CHECK(said(head + "1 2 3\n4 5 6\n") == "");
  CHECK(said(head + "1 2 3 4 5 6") == "");
  CHECK(said("NCOLS 3\r\nNRows 2\r\nxllcenter -1e3\r\nyllcenter +5.\r\ndx 1\r\ndy 2\r\n"
             "-1.5e-3 .5 5.\r\n1E5 -9999 +7\r\n") == "");
  CHECK(said(head + "1,5 2 3\n\n\t4   5\n6\n\n") == "");
  CHECK(said(head + "nan -inf 1.#QNAN\n-1.#IND NaN 1\n") == "");
}

TEST_CASE("words that are no numbers are named with their line") {
  const auto refused = [](const std::string& word, int line) {
    return "line " + std::to_string(line) + " of 'a.asc' has '" + word + "', which is not a number";
  };
  CHECK(said(head + "1 2 3\n4 x12 6\n") == refused("x12", 8));
  CHECK(said(head + "1 2 3\n4 12m 6\n") == refused("12m", 8));
  for (const std::string word : {"1.2.3", "--5", "1e", "1e+", "-", ".", "1,000.5", "0x1F", "1;2"})
    CHECK(said(head + word + " 2 3\n4 5 6\n") == refused(word, 7));
  const std::string digits(80, '1');
  CHECK(said(head + digits + " 2 3\n4 5 6\n") == refused(digits.substr(0, 65), 7));
  CHECK(said("ncols 3\nnrows 2\nxllcorner O\n") == refused("O", 3));
  CHECK(said("ncols three\nnrows 2\n") ==
        "line 1 of 'a.asc' has 'three' in place of a number of cells");
}

TEST_CASE("the head of a grid has finite numbers, each once") {
  for (const std::string word : {"nan", "inf", "-NaN"})
    CHECK(said("ncols 3\nnrows 2\nxllcorner " + word + "\n") ==
          "line 3 of 'a.asc' has '" + word + "', which is not a number");
  CHECK(said("ncols 3\nnrows 2\nNODATA_value nan\n1 2 3 4 5 6\n") == "");
  CHECK(said("ncols 3\nncols 2\nnrows 2\n1 2 3 4 5 6\n") ==
        "line 2 of 'a.asc' has a second 'ncols'");
  CHECK(said("ncols 9000000000000000000\nnrows 9000000000000000000\n1 2\n") ==
        "line 1 of 'a.asc' has '9000000000000000000' in place of a number of cells");
}

TEST_CASE("grids have as many values as columns times rows") {
  CHECK(said(head + "1 2 3\n4 5\n") ==
        "'a.asc' ends after 5 values; its 3 columns and 2 rows take 6");
  CHECK(said(head + "1 2 3 0\n4 5 6 0\n") ==
        "'a.asc' has more values than its 3 columns and 2 rows take, from line 8 on");
}

TEST_CASE("files in several pieces are read whole, and others pass") {
  std::string text = "ncols 1000\nnrows 400\ncellsize 1\n";
  for (int row = 0; row < 400; ++row) {
    for (int column = 0; column < 1000; ++column) text += row == 399 ? "x " : "12.34 ";
    text += "\n";
  }
  CHECK(text.size() > std::size_t{2} << 20);
  CHECK(said(text) == "line 403 of 'a.asc' has 'x', which is not a number");
  CHECK(said("II*\x01 some GeoTIFF") == "");
  CHECK(said("north: 5\nsouth: x\n") == "");
  CHECK(said("") == "");
}
