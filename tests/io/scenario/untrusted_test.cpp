// Files of others that are not what they should be.
#include <doctest/doctest.h>
#include <hdf5.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "io/base/atomic_file.h"
#include "io/base/hdf_handle.h"
#include "io/base/side_files.h"
#include "io/json/json_text.h"
#include "io/run/checkpoint.h"
#include "io/scenario/scenario.h"
#include "physics/base/error.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("lahar-untrusted-" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

/// Why a side file is refused; "opened" where it is not.
std::string refusal(const fs::path& file) {
  std::string reason;
  return open_side_file("x", file.string(), reason) ? "opened" : reason;
}

/// What reading a dataset "data" of a file says; "read" where it is opened.
std::string data_refusal(const fs::path& file) {
  try {
    const HdfSession hdf(file, "read");
    const HdfHandle in = open_file(hdf, file);
    open_data(hdf, in, "data");
    return "read";
  } catch (const IoError& error) {
    return error.what();
  }
}

/// A file with a dataset `name` of so many numbers, in chunks or not.
void write_data(const fs::path& file, const char* name, hsize_t size, hsize_t chunk,
                const char* external = nullptr) {
  const hid_t out = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(1, &size, nullptr), plan = H5Pcreate(H5P_DATASET_CREATE);
  if (chunk > 0) H5Pset_chunk(plan, 1, &chunk);
  if (external) H5Pset_external(plan, external, 0, size * sizeof(double));
  const hid_t data =
      H5Dcreate2(out, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, plan, H5P_DEFAULT);
  REQUIRE(data >= 0);
  H5Dclose(data), H5Pclose(plan), H5Sclose(space), H5Fclose(out);
}

bool has(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("side files must be regular files") {
  const Folder folder;
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(refusal(folder / "pipe") == "is not a regular file");  // and nobody waits for a writer
  CHECK(refusal("/dev/zero") == "is not a regular file");
  CHECK(refusal("/dev/null") == "is not a regular file");
  CHECK(refusal(fs::temp_directory_path()) == "is a folder, not a file");
  CHECK(refusal(folder / "none") == "does not exist");
  std::ofstream(folder / "empty").close();
  CHECK(refusal(folder / "empty") == "is empty");
  std::string reason;
  CHECK(!read_text_file("/dev/zero", reason));
  CHECK(reason == "is not a regular file");
}

TEST_CASE("a device does not become a file") {
  CHECK_THROWS_WITH_AS(write_text_file("/dev/null", "x"),
                       "cannot write /dev/null: it is not a regular file", IoError);
  CHECK(fs::is_character_file("/dev/null"));
}

TEST_CASE("JSON that is deeper than a stack is none") {
  const auto nested = [](std::size_t depth) {
    return json_of_text(std::string(depth, '[') + std::string(depth, ']'));
  };
  CHECK(nested(50).is_array());
  CHECK(nested(200).is_discarded());
  CHECK(nested(1'000'000).is_discarded());
  CHECK(json_of_text("{").is_discarded());
}

TEST_CASE("a compound whose members lie beyond it, or on each other, is refused") {
  const Folder folder;
  const auto refusal_of = [&](std::size_t size, std::size_t first, std::size_t second) {
    const fs::path file = folder / "compound.h5";
    const hid_t out = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = H5Tcreate(H5T_COMPOUND, size);
    H5Tinsert(type, "aaaaaaa", first, H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "bbbbbbb", second, H5T_NATIVE_DOUBLE);
    const hsize_t n = 1;
    const hid_t space = H5Screate_simple(1, &n, nullptr);
    const hid_t data = H5Dcreate2(out, "data", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dclose(data), H5Sclose(space), H5Tclose(type), H5Fclose(out);
    // The library refuses to write it: the place of the second member becomes another.
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(bytes), {}};
    const auto at = text.find("bbbbbbb");
    REQUIRE(at != std::string::npos);
    bytes.clear();
    bytes.seekp(static_cast<std::streamoff>(at + 8));
    bytes.put('\x0c');
    bytes.close();
    return data_refusal(file);
  };
  CHECK(has(refusal_of(16, 0, 8), "the type of 'data' is damaged"));  // 12 + 8 > 16
  CHECK(refusal_of(32, 8, 16) != "read");  // 8 to 16 and 12 to 20, which HDF5 finds itself
  CHECK(refusal_of(32, 0, 16) == "read");
}

TEST_CASE("datasets that lead to other files, or are larger than theirs, are refused") {
  const Folder folder;
  write_data(folder / "good.h5", "data", 100, 10);
  CHECK(data_refusal(folder / "good.h5") == "read");
  write_data(folder / "huge.h5", "data", hsize_t{1} << 50, 1024);
  CHECK(has(data_refusal(folder / "huge.h5"), "'data' claims 8192.0 TiB of values"));
  std::ofstream(folder / "secret") << std::string(80, 'x');
  write_data(folder / "external.h5", "data", 10, 0, (folder / "secret").c_str());
  CHECK(has(data_refusal(folder / "external.h5"), "has its data in other files"));
  write_data(folder / "soft.h5", "other", 10, 0);
  const hid_t soft = H5Fopen((folder / "soft.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Lcreate_soft("/other", soft, "data", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(soft);
  CHECK(has(data_refusal(folder / "soft.h5"), "'data' is a link to somewhere else"));
  write_data(folder / "link.h5", "other", 10, 0);
  const hid_t link = H5Fopen((folder / "link.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Lcreate_external((folder / "good.h5").c_str(), "data", link, "data", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(link);
  CHECK(has(data_refusal(folder / "link.h5"), "'data' is a link to somewhere else"));
  REQUIRE(::mkfifo((folder / "pipe.h5").c_str(), 0600) == 0);
  CHECK(has(data_refusal(folder / "pipe.h5"), "it is not a regular file"));
}

TEST_CASE("values in a header that are fewer than they claim are refused") {
  const Folder folder;
  const fs::path file = folder / "compact.h5";
  const hid_t out = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t n = 0x0777;
  const hid_t space = H5Screate_simple(1, &n, nullptr);
  const hid_t plan = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_layout(plan, H5D_COMPACT);
  const hid_t data =
      H5Dcreate2(out, "data", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, plan, H5P_DEFAULT);
  H5Dclose(data), H5Pclose(plan), H5Sclose(space), H5Fclose(out);
  CHECK(data_refusal(file) == "read");
  // The library refuses to write it: the number of values becomes another.
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string number("\x77\x07\0\0\0\0\0\0", 8);
  int found = 0;
  for (auto at = text.find(number); at != std::string::npos; at = text.find(number, at + 8)) {
    text[at + 1] = '\x47';
    ++found;
  }
  REQUIRE(found > 0);
  std::ofstream(file, std::ios::binary) << text;
  CHECK(has(data_refusal(file), "'data' claims more values than there are"));
}

TEST_CASE("results stay in the folder of results, whatever uuid and title say") {
  const auto folder_of = [](const std::string& title, const std::string& uuid) -> std::string {
    try {
      const Scenario scenario =
          read_scenario_text(R"({"title": ")" + title +
                                 R"(", "mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "region", "material_id": 0}}],
 "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
 "analysis": {"nsteps": 1, "dt": 1e-3)" +
                                 (uuid.empty() ? "" : R"(, "uuid": ")" + uuid + '"') + "}}",
                             "/case");
      return std::get<Model<2>>(scenario.model).output.folder;
    } catch (const InputError& error) {
      return error.what();
    }
  };
  CHECK(folder_of("", "a") == "/case/results/a");
  CHECK(folder_of("../../x", "") == "/case/results/..-..-x");
  CHECK(folder_of("/etc/x", "") == "/case/results/etc-x");
  CHECK(folder_of("..", "") == "/case/results/scenario");
  for (const char* uuid : {"..", ".", "../../x", "/etc/x", "a/b", "a\\u0000b"})
    CHECK(has(folder_of("", uuid), "'uuid' must be the name of a folder"));
}
