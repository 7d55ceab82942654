/// \file Energy that a patch counts between two rows of history.csv.
#pragma once

namespace lahar {

/// What one patch contributes to a row of history.csv (HistoryRow), reset after each row.
struct PatchWork {
  double internal = 0, external = 0;
  double damping = 0;   ///< [J] with friction, and with what the velocity transfer takes
  double friction = 0;  ///< [J] of damping: what friction at walls and between bodies takes
  double divided = 0;   ///< increments that a law could only do in parts (update_in_parts())
  PatchWork& operator+=(const PatchWork& other) {
    internal += other.internal;
    external += other.external;
    damping += other.damping;
    friction += other.friction;
    divided += other.divided;
    return *this;
  }
  bool operator==(const PatchWork&) const = default;
};

}  // namespace lahar
