/// \file Regions between two surfaces that are named in the wrong order.
#pragma once

#include <string>

#include "io/json/json_source.h"
#include "io/scenario/geometry.h"

namespace lahar {

/// What to say of a region without particles where it, or a part of it, lies between surfaces of
/// which the first is above the second; empty if there are none.
template <int Dim>
std::string wrong_order(const JsonValue& region, const Geometries<Dim>& geometries);

extern template std::string wrong_order<2>(const JsonValue&, const Geometries<2>&);
extern template std::string wrong_order<3>(const JsonValue&, const Geometries<3>&);

/// Whether surfaces bound a region: it lies `below` one or `between` two, or has a part that does.
bool names_surface(const JsonValue& region);

}  // namespace lahar
