// The table of boundary conditions, and the example of CONTRIBUTING.md: it compiles, and does what
// it says.
#include "physics/boundary/conditions.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/physics/boundary/contributing_example.h"

using namespace lahar;

namespace {

std::string text_of_file(const char* name) {
  std::ostringstream text;
  text << std::ifstream(std::filesystem::path(LAHAR_SOURCE_DIR) / name).rdbuf();
  return text.str();
}

}  // namespace

TEST_CASE("the boundary condition of CONTRIBUTING.md is the one that is compiled here") {
  std::istringstream lines(text_of_file("tests/physics/boundary/contributing_example.h"));
  std::string indented;
  for (std::string line; std::getline(lines, line);)
    indented += line.empty() ? "\n" : "    " + line + "\n";
  CHECK(indented.size() > 1000);
  CHECK(text_of_file("CONTRIBUTING.md").find(indented) != std::string::npos);
}

TEST_CASE("the boundary condition of CONTRIBUTING.md acts on a node, and brakes it") {
  static_assert(NodeCondition<NodeDrag> && ActsOnNode<NodeDrag> && !takes_means<NodeDrag>);
  const NodeDrag drag{.node = 4, .coefficient = 3};
  CHECK(place_of(drag) == std::pair<Index, int>(4, 0));
  const NodeMeans<2> none;
  const NodeAction<2> action = drag.act<2>({.mass = 1,
                                            .position = Vec<2>(0, 0),
                                            .velocity = Vec<2>(3, -4),
                                            .means = none,
                                            .time = 0,
                                            .dt = 1e-3,
                                            .factor = 1});
  CHECK(action.force.isZero(0.0));
  CHECK(action.dashpot[0] == 15);
  CHECK(action.dashpot[1] == 15);
}

TEST_CASE("conditions have different keys, and entries of a node combine as they say") {
  std::set<std::string_view> keys;
  int conditions = 0;
  for_each_condition([&]<class T>() {
    keys.insert(T::key);
    ++conditions;
  });
  CHECK(static_cast<int>(keys.size()) == conditions);

  std::vector<NodeVelocity> first{{3, 1, 1.0}, {2, 0, 2.0}, {3, 1, 3.0}, {3, 0, 4.0}};
  combine(first);
  REQUIRE(first.size() == 3);
  CHECK(first[0].velocity == 2.0);
  CHECK(first[1].velocity == 4.0);
  CHECK(first[2].velocity == 1.0);
  std::vector<NodeAcceleration> last{{3, 1, 1.0}, {2, 0, 2.0}, {3, 1, 3.0}};
  combine(last);
  REQUIRE(last.size() == 2);
  CHECK(last[1].acceleration == 3.0);
  std::vector<NodeSpring> all{{3, 1, 1.0, 0}, {3, 1, 1.0, 0}};
  combine(all);
  CHECK(all.size() == 2);
}

TEST_CASE("a spring on a node that is too light for it is weaker") {
  const NodeSpring spring{.node = 0, .dir = 1, .stiffness = 100, .damping = 7};
  NodeMeans<2> means;
  means.mass = 1;
  means.displacement = Vec<2>(5, 0.25);
  const auto act = [&](double mass) {
    return spring.act<2>({.mass = mass,
                          .position = Vec<2>(0, 0),
                          .velocity = Vec<2>(0, 0),
                          .means = means,
                          .time = 0,
                          .dt = 0.5,
                          .factor = 1});
  };
  CHECK(act(1000).force[1] == -25);
  CHECK(act(1000).force[0] == 0);
  CHECK(act(1000).dashpot[1] == 7);
  CHECK(act(5).force[1] == -5);  // m / dt^2 = 20 N/m
}
