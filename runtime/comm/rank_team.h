/// \file The processes of a run as the team that reads its scenario.
#pragma once

#include "io/base/team.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// For ScenarioOptions::team: every rank reads its share.
class RankTeam : public Team {
 public:
  explicit RankTeam(Communicator ranks) : ranks_(ranks) {}
  int index() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  std::vector<Bytes> gather_bytes(Bytes own) const override;
  std::vector<Bytes> exchange_bytes(std::vector<Bytes> to) const override;

 private:
  Communicator ranks_;
};

}  // namespace lahar
