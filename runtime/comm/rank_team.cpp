#include "runtime/comm/rank_team.h"

namespace lahar {

std::vector<Team::Bytes> RankTeam::gather_bytes(Bytes own) const {
  const std::vector<Index> size{static_cast<Index>(own.size())};
  const std::vector<Index> sizes = ranks_.gather_all(std::span(size));
  const Bytes all = ranks_.gather_all(std::span<const std::byte>(own));
  std::vector<Bytes> parts;
  auto at = all.begin();
  for (const Index n : sizes) {
    parts.emplace_back(at, at + n);
    at += n;
  }
  return parts;
}

std::vector<Team::Bytes> RankTeam::exchange_bytes(std::vector<Bytes> to) const {
  return ranks_.exchange(to);
}

}  // namespace lahar
