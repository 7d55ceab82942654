#include "tests/io/frames/frame_samples.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <random>

namespace lahar::test {

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

Frame sample_frame(int dim, Index n) {
  std::mt19937_64 random(1);
  const auto numbers = [&](Index count) {
    static constexpr double awkward[] = {0.0, -0.0, std::numeric_limits<double>::denorm_min(), 0.1};
    std::uniform_real_distribution<double> uniform(-1e6, 1e6);
    std::vector<double> values(static_cast<std::size_t>(count));
    for (double& value : values) value = random() % 8 < 4 ? awkward[random() % 4] : uniform(random);
    return values;
  };
  Frame frame;
  frame.step = 1234567890123;
  frame.time = 0.1 + 0.2;
  frame.dim = dim;
  for (Index i = 0; i < n; ++i) {
    frame.id.push_back(3 * i + 1);
    frame.material.push_back(static_cast<std::int32_t>(i % 3) - 1);
  }
  frame.coordinates = numbers(n * dim);
  frame.columns = {
      {"velocity", "m/s", dim, numbers(n * dim)}, {"displacement", "m", dim, numbers(n * dim)},
      {"stress", "Pa", 6, numbers(n * 6)},        {"strain", "-", 6, numbers(n * 6)},
      {"volume", "m^3", 1, numbers(n)},           {"mass", "kg", 1, numbers(n)},
      {"pressure", "Pa", 1, numbers(n)}};
  return frame;
}

Frame two_particles() {
  Frame frame;
  frame.step = 10;
  frame.time = 0.25;
  frame.dim = 2;
  frame.id = {0, 7};
  frame.material = {0, 1};
  frame.coordinates = {0.5, 0.25, 1.5, 0.1};
  frame.columns = {{"velocity", "m/s", 2, {0, -1, 1e-20, 1e300}},
                   {"displacement", "m", 2, {1, 2, 3, 4}},
                   {"stress", "Pa", 6, {-1, -2, -3, 4, 0, 0, 1e5, 2e5, 3e5, -0.5, 0, 0}},
                   {"strain", "-", 6, {1e-3, 2e-3, 0, 3e-3, 0, 0, 0, 0, 0, 0, 0, 0}},
                   {"volume", "m^3", 1, {0.001, 0.002}},
                   {"mass", "kg", 1, {1, 2}},
                   {"pressure", "Pa", 1, {100, 0.30000000000000004}}};
  return frame;
}

Frame part_of(const Frame& frame, Index first, Index n) {
  const auto cut = [&](const auto& values, Index components) {
    return std::decay_t<decltype(values)>(values.begin() + first * components,
                                          values.begin() + (first + n) * components);
  };
  Frame part = frame;
  part.id = cut(frame.id, 1);
  part.material = cut(frame.material, 1);
  part.coordinates = cut(frame.coordinates, frame.dim);
  for (FrameColumn& column : part.columns) column.values = cut(column.values, column.components);
  return part;
}

bool same_bits(const Frame& a, const Frame& b) {
  const auto same = [](const std::vector<double>& x, const std::vector<double>& y) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](double p, double q) {
      return std::bit_cast<std::uint64_t>(p) == std::bit_cast<std::uint64_t>(q);
    });
  };
  return a.step == b.step && same({a.time}, {b.time}) && a.dim == b.dim && a.id == b.id &&
         a.material == b.material && same(a.coordinates, b.coordinates) &&
         std::equal(a.columns.begin(), a.columns.end(), b.columns.begin(), b.columns.end(),
                    [&](const FrameColumn& x, const FrameColumn& y) {
                      return x.name == y.name && x.unit == y.unit && x.components == y.components &&
                             same(x.values, y.values);
                    });
}

}  // namespace lahar::test
