// Ranks that wait for others go on with what those may need of them.
#include <doctest/doctest.h>
#include <sched.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "graph/executor.h"
#include "runtime/comm/communicator.h"

using namespace lahar;

TEST_CASE("whoever waits for other ranks is called back meanwhile") {
  const Communicator ranks = Communicator::world(), copy = ranks;
  if (!ranks.several()) return;
  constexpr int tag = 77;
  const auto news_of = [&](auto wait) {
    bool told = false;
    ranks.while_waiting([&] {
      if (std::exchange(told, true) || ranks.rank() == 0) return;
      const int rank = ranks.rank();
      MPI_Send(&rank, 1, MPI_INT, 0, tag, MPI_COMM_WORLD);  // short: nobody waits
    });
    if (ranks.rank() == 0)  // does not come before it has heard of all others
      for (int r = 1; r < ranks.size(); ++r) {
        int rank = 0;
        MPI_Recv(&rank, 1, MPI_INT, r, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        CHECK(rank == r);
      }
    wait();
    ranks.while_waiting({});
    ranks.wait_for_all();
  };
  news_of([&] { copy.wait_for_all(); });
  news_of([&] { CHECK(copy.sum(Index{1}) == ranks.size()); });
  news_of([&] { CHECK(copy.max(Index{copy.rank()}) == ranks.size() - 1); });
  news_of([&] {
    std::string text = copy.rank() == 0 ? "news" : "";
    copy.broadcast(text);
    CHECK(text == "news");
  });
  news_of([&] {
    const std::vector<int> own{copy.rank()};
    CHECK(copy.gather_all(std::span(own)).size() == static_cast<std::size_t>(ranks.size()));
  });
  news_of([&] {
    const std::vector<std::vector<int>> to(static_cast<std::size_t>(ranks.size()), {copy.rank()});
    const auto from = copy.exchange(to);
    for (int r = 0; r < ranks.size(); ++r)
      CHECK(from[static_cast<std::size_t>(r)] == std::vector<int>{r});
  });
}

TEST_CASE("ranks share cores where they have more threads than the system lets them use") {
  const Communicator world = Communicator::world();
  if (!world.several()) return;
  const Index enough = world.sum(Index{available_threads()});
  CHECK_FALSE(world.have_cores(static_cast<int>(enough) + 1));
  const bool have = world.have_cores(1);
  CHECK(world.sum(Index{have}) == (have ? world.size() : 0));
  if (world.size() > static_cast<int>(std::thread::hardware_concurrency())) CHECK_FALSE(have);
}

TEST_CASE("ranks that are bound to a core each have cores") {
  const Communicator world = Communicator::world();
  cpu_set_t all, own;
  CPU_ZERO(&all);
  REQUIRE(sched_getaffinity(0, sizeof all, &all) == 0);
  std::vector<int> cores;
  for (int core = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(core, &all)) cores.push_back(core);
  if (!world.several() || world.any(static_cast<int>(cores.size()) < world.size())) return;
  CPU_ZERO(&own);
  CPU_SET(cores[static_cast<std::size_t>(world.rank())], &own);
  REQUIRE(sched_setaffinity(0, sizeof own, &own) == 0);
  CHECK(world.have_cores(1));
  CHECK_FALSE(world.have_cores(2));
  sched_setaffinity(0, sizeof all, &all);
}
