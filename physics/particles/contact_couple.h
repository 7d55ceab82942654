/// \file Where forces of rigid bodies on a particle act: at their surfaces (rigid_contact.h).
#pragma once

#include <Eigen/Core>
#include <array>

#include "physics/particles/particles.h"

namespace lahar {

/// Of Column::contact_couple, in the order of Voigt's notation.
template <int Dim>
inline constexpr std::size_t contact_components = Dim == 2 ? 3 : 6;

template <int Dim>
using ContactCouple = Eigen::Matrix<double, Dim, Dim>;

/// Row of component (a, b).
template <int Dim>
constexpr std::size_t row_of_couple(int a, int b) {
  constexpr std::size_t plane[2][2] = {{0, 2}, {2, 1}};
  constexpr std::size_t space[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  return Dim == 2 ? plane[a % 2][b % 2] : space[a][b];
}

template <int Dim, class Row>
ContactCouple<Dim> contact_couple(const std::array<Row, contact_components<Dim>>& rows, Local p) {
  ContactCouple<Dim> couple;
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) couple(a, b) = rows[row_of_couple<Dim>(a, b)][p];
  return couple;
}

template <int Dim>
void set_contact_couple(const std::array<double*, contact_components<Dim>>& rows, Local p,
                        const ContactCouple<Dim>& couple) {
  for (int a = 0; a < Dim; ++a)
    for (int b = a; b < Dim; ++b) rows[row_of_couple<Dim>(a, b)][p] = couple(a, b);
}

}  // namespace lahar
