/// \file Random scenarios against a property that must hold for all of them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/properties/scenario_generator.h"

namespace lahar::test {

/// What a property found for a case.
struct Verdict {
  std::string refused;     ///< why the scenario is not valid; "" = it is
  std::string error;       ///< with which the run ends everywhere; "" = at its end
  std::string difference;  ///< between runs that must be alike; "" = none
};

/// A case lies in a folder, as case.json with its side files. With several ranks all ranks call it
/// together, and get the same.
using Property = std::function<Verdict(const GeneratedCase&, const std::filesystem::path& folder,
                                       Choices& choices)>;

/// Which cases: `count` seeds from `first`. The environment variable
/// LAHAR_SCENARIOS="FIRST[:COUNT]" says others, and LAHAR_CHOICES="NAME=NUMBER ..." makes some
/// choices of all of them.
struct Seeds {
  std::uint64_t first = 1;
  int count = 1;
};

/// Who writes files and speaks: with several ranks one of them.
struct Speaker {
  bool speaks = true;
  std::filesystem::path folder;        ///< all ranks see it; cases are written into it
  std::function<void()> wait_for_all;  ///< called after the one has written
  std::string command;                 ///< that runs this test case alone
};

struct Tally {
  int cases = 0, refused = 0, ended_early = 0;
  std::map<std::string, int> reasons;  ///< of refused ones, and errors of runs
  std::vector<std::string> failures;   ///< for the terminal, with the smallest scenario
};

/// Try all cases; the first failures are made smaller. The same on all ranks.
Tally try_cases(Seeds seeds, const Property& property, const Speaker& speaker);

/// "300 scenarios, 2 refused (0.7 %), 31 ended early", with reasons where LAHAR_SCENARIOS is given.
std::string summary(const Tally& tally);

}  // namespace lahar::test
