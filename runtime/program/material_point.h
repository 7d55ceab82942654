/// \file One material point that is led along a path of strains, stresses or both.
#pragma once

#include <vector>

#include "physics/model/model.h"

namespace lahar {

/// The state of a material point in space. Stresses are positive in tension; Voigt order xx yy zz
/// xy yz xz, engineering shear strains.
class MaterialPoint {
 public:
  MaterialPoint(const Law& law, const Voigt& stress);

  /// A strain increment over dt [s], without rotation. False (and nothing changes) if the law finds
  /// no stress that it allows.
  bool strain_by(const Voigt& increment, double dt);

  /// The same where components with `stress_controlled` are to reach `target`: their strain
  /// increments are found by Broyden's method, or else Newton's with a numerical tangent, with
  /// steps that are halved while they bring nothing. Where both find nothing, the increment is
  /// divided. `increment` holds those of the others, and a first guess of these; then all. False
  /// (and nothing changes) if the stress is not reached with most_answers of the law.
  bool load_by(Voigt& increment, const std::array<bool, 6>& stress_controlled, const Voigt& target,
               double dt);

  const Voigt& stress() const { return stress_; }
  const Voigt& strain() const { return strain_; }  ///< sum of the increments
  /// State variables, those that follow from the stress included.
  std::vector<double> state() const;
  /// Answers of the law for the last increment and its parts. A search that finds its stress takes
  /// some ten; this many take seconds where the law itself has to divide each.
  static constexpr int most_answers = 800;
  int answers() const { return answers_; }
  Index divided() const { return divided_; }  ///< increments that were done in parts

 private:
  struct Answer {
    bool found = false;
    Voigt stress;
    std::vector<double> state;
    bool divided = false;
  };
  class Search;
  bool load_by(Voigt& increment, const std::array<bool, 6>& stress_controlled, const Voigt& target,
               double dt, int divisions);
  Answer answer(const Law& law, const Voigt& increment, double dt) const;
  void take(const Voigt& increment, Answer&& answer);

  Law law_, of_faces_;  ///< `of_faces_` where stresses are given
  Voigt stress_, strain_{};
  std::vector<double> state_;
  Index divided_ = 0;
  mutable int answers_ = 0;
};

/// Mean stress [Pa], positive in compression, and deviatoric stress sqrt(3 J2) [Pa].
double mean_pressure(const Voigt& stress);
double deviatoric_stress(const Voigt& stress);

}  // namespace lahar
