/// \file Cases that the program runs against solutions from the literature: `lahar verify`.
#pragma once

#include <string>

namespace lahar {

struct VerifyArguments {
  std::string name;        ///< of a case; empty = list them
  std::string output;      ///< folder of pictures and tables; empty = verify/NAME
  int threads = 0;         ///< 0 = all cores this process may use
  bool published = false;  ///< time step, scheme and duration as published, however long that takes
};

/// Exit code: 0 within the tolerances, 1 outside, 2 no such case.
int verify_command(const VerifyArguments& arguments);

/// A verification case. One line in verify_command.cpp makes it known.
struct VerificationCase {
  const char* name;
  const char* what;
  bool (*run)(const VerifyArguments&);  ///< true: within the tolerances
};

bool verify_plate_with_hole(const VerifyArguments& arguments);
bool verify_manufactured(const VerifyArguments& arguments);

}  // namespace lahar
