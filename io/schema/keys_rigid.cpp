// Table of rigid bodies.
#include "io/schema/keys.h"

namespace lahar {

const Section& rigid_body_section() {
  static const Section section{
      .name = "a rigid body",
      .path = "rigid_bodies[]",
      .help =
          "A body that does not deform: terrain, an obstacle, a tool, a boulder. It may cut the "
          "mesh anywhere. It pushes particles and does not pull, and they slide on it with Coulomb "
          "friction. Without `velocity`, `spin`, `density` and `mass` it is at rest. With "
          "`velocity` or `spin` it moves as they say. With `density` or `mass` it moves by the "
          "forces of particles, of other bodies and of gravity. Sides of a box of cells hold it, "
          "too, where walls or constraints hold all their nodes.",
      .keys = {
          {.key = "name",
           .kinds = text,
           .help = "name, for messages and history; default its number",
           .native = true},
          {.key = "region",
           .kinds = object,
           .help = "what it fills at the start",
           .required = true,
           .section = region_section,
           .native = true},
          {.key = "friction",
           .kinds = number | text,
           .help = "Coulomb's coefficient, or \"rough\": no sliding while pressed against it",
           .unit = "-",
           .fallback = "0",
           .native = true},
          {.key = "cohesion",
           .kinds = number,
           .help = "shear stress that acts beside friction while pressed against it",
           .unit = "Pa",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "restitution",
           .kinds = number,
           .help = "how fast a free body leaves another rigid body, by the speed along the normal "
                   "with which it meets it. The larger coefficient of the two counts",
           .unit = "-",
           .fallback = "0",
           .min = 0,
           .max = 1,
           .native = true},
          {.key = "velocity",
           .kinds = vector,
           .help = "prescribed velocity; of a free body that at the start. A free body that the "
                   "stage before had, too, keeps its own",
           .unit = "m/s",
           .native = true},
          {.key = "spin",
           .kinds = number | vector,
           .help = "prescribed angular velocity about `centre`: 2D a number, counter-clockwise; 3D "
                   "a vector along its axis; of a free body that at the start",
           .unit = "rad/s",
           .native = true},
          {.key = "centre",
           .kinds = vector,
           .help = "the point about which it turns, of a free body its centre of mass. "
                   "`rigid_bodies.csv` has the place of this point, and torques about it. Default: "
                   "the centre of its volume; of a body without an end (a half space, `below` a "
                   "surface) the origin. A prescribed `spin` needs it",
           .unit = "m",
           .native = true},
          {.key = "math_function_id",
           .kinds = id,
           .help = "function of time that multiplies the prescribed velocity and spin",
           .min = 0,
           .native = true},
          {.key = "density",
           .kinds = number,
           .help = "of a free body: gives its mass, centre and inertia",
           .unit = "kg/m^3",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "mass",
           .kinds = number,
           .help = "of a free body, in place of `density`; inertia as if it had one density",
           .unit = "kg",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "inertia",
           .kinds = number | numbers,
           .help = "of a free body that is hollow or not of one density: moments about `centre`. "
                   "2D: a number, per metre of depth. 3D: along x, y, z at the start [xx, yy, zz], "
                   "or with [xx, yy, zz, xy, yz, xz], where xy is minus the integral of density "
                   "times x y. Default: as if it had one density",
           .unit = "kg m^2",
           .native = true},
          {.key = "fixed",
           .kinds = texts,
           .help = "of a free body: how it does not move: \"x\", \"y\", \"z\", or \"spin\". A "
                   "`velocity` or `spin` there is refused",
           .native = true},
      }};
  return section;
}

}  // namespace lahar
