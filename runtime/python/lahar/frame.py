"""The particles at one step."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Callable, Iterator, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _engine

if TYPE_CHECKING:
    import pandas

Array = npt.NDArray[Any]

_VECTOR = ("x", "y", "z")
_TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")


def _square(vectors: Array) -> Array:
    return np.asarray((vectors * vectors).sum(axis=1))


def _mean(tensor: Array) -> Array:
    return np.asarray(tensor[:, :3].sum(axis=1) / 3)


def _deviator_square(tensor: Array, shear: float) -> Array:
    """s:s of the deviator s. Squares of shear components count `shear` times: 2, or 1/2 of
    engineering shears."""
    return np.asarray(_square(tensor[:, :3] - _mean(tensor)[:, None]) + shear * _square(tensor[:, 3:]))


def _principal(tensor: Array, which: int) -> Array:
    """A principal value, of 0, 1, 2 in ascending order."""
    rows = tensor[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    return np.asarray(np.linalg.eigvalsh(rows)[:, which])


class _Derived(NamedTuple):
    unit: str
    columns: tuple[str, ...]  #: fields that it follows from
    value: Callable[..., Any]  #: of these fields; an array


#: Fields with one number per particle that follow from others: those of the engine
#: (physics/particles/derived_fields.h), as `lahar picture` makes them.
_DERIVED = {
    "speed": _Derived("m/s", ("velocity",), lambda v: np.sqrt(_square(v))),
    "kinetic_energy": _Derived("J", ("mass", "velocity"), lambda m, v: 0.5 * m * _square(v)),
    "mass_density": _Derived("kg/m^3", ("mass", "volume"), lambda m, volume: m / volume),
    "mean_stress": _Derived("Pa", ("stress",), lambda s: -_mean(s)),
    "von_mises_stress": _Derived("Pa", ("stress",), lambda s: np.sqrt(1.5 * _deviator_square(s, 2.0))),
    "volumetric_strain": _Derived("-", ("strain",), lambda e: 3 * _mean(e)),
    "equivalent_strain": _Derived("-", ("strain",), lambda e: np.sqrt(2 / 3 * _deviator_square(e, 0.5))),
    "total_mean_stress": _Derived("Pa", ("stress", "pore_pressure"), lambda s, p: p - _mean(s)),
    "principal_stress_1": _Derived("Pa", ("stress",), lambda s: _principal(s, 2)),
    "principal_stress_2": _Derived("Pa", ("stress",), lambda s: _principal(s, 1)),
    "principal_stress_3": _Derived("Pa", ("stress",), lambda s: _principal(s, 0)),
}
#: Fields that follow from what frames do not have, or have six components.
_ONLY_ASKED = ("porosity", "liquid_mass", "deviatoric_stress", "deviatoric_strain")


class Frame:
    """The particles at one step, by ascending id: `frame["velocity"]` is a numpy array.

    Vectors have a column for each dimension, tensors six: xx yy zz xy yz xz. One component is
    `frame["velocity_x"]` or `frame["stress_xy"]`. Fields that follow from these are made where they
    are asked for: `frame["speed"]`, `frame["von_mises_stress"]`; `derived` has their names. `in` and
    iteration tell the names of fields that the frame has.
    """

    def __init__(self, raw: dict[str, Any]) -> None:
        self.step: int = raw["step"]
        self.time: float = raw["time"]  #: [s]
        self.dim: int = raw["dim"]
        self.id: Array = raw["id"]
        self.material: Array = raw["material"]  #: ids of materials, as in the scenario
        self.units: dict[str, str] = {"coordinates": "m"}
        self._fields: dict[str, Array] = {"coordinates": raw["coordinates"]}
        for name, unit, values in raw["columns"]:
            self.units[name] = unit
            self._fields[name] = values

    @classmethod
    def read(cls, file: Union[str, os.PathLike[str]]) -> Frame:
        """Read a frame file, such as RUN/frames/particles_0000001000.hdf."""
        return cls(_engine.read_frame(os.fspath(file)))

    def __len__(self) -> int:
        return len(self.id)

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __contains__(self, name: object) -> bool:
        return name in self._fields

    def __getitem__(self, name: str) -> Array:
        if name in self._fields:
            return self._fields[name]
        if name in ("id", "material"):
            return self.id if name == "id" else self.material
        field, _, suffix = name.rpartition("_")
        if field in self._fields and (suffix in self._suffixes(field)
                                      or name == "strain_zz"):
            return self._fields[field][:, _component(suffix)]
        if name in self.derived:
            field_of = _DERIVED[name]
            return np.asarray(field_of.value(*(self._fields[column] for column in field_of.columns)))
        raise KeyError(f"{name}: {self._why_missing(name)}the fields are id, material, "
                       f"{', '.join([*self._fields, *self.derived])}, and components such as velocity_x")

    @property
    def derived(self) -> list[str]:
        """Names of fields that follow from those the frame has."""
        return [name for name, one in _DERIVED.items()
                if name not in self._fields and all(column in self._fields for column in one.columns)]

    def unit(self, name: str) -> str:
        """The unit of a field, or of one of its components."""
        if name not in self.units and name in self.derived:
            return _DERIVED[name].unit
        return self.units.get(name, self.units.get(name.rpartition("_")[0], ""))

    def _why_missing(self, name: str) -> str:
        """What to do to have a field of the engine that the frame does not have."""
        if name in _DERIVED:
            missing = [column for column in _DERIVED[name].columns if column not in self._fields]
            return f"it follows from {' and '.join(missing)}, which this frame does not have; "
        if name in _ONLY_ASKED or name.rpartition("_")[0] in _ONLY_ASKED:
            return "frames have it where \"post_processing\": {\"vtk\": [...]} names it before the run; "
        return ""

    @property
    def particles(self) -> pandas.DataFrame:
        """All fields as a table by particle id, named as `lahar export --to csv` names them."""
        import pandas

        table: dict[str, Array] = {"material": self.material}
        for name, values in self._fields.items():
            prefix = "coord" if name == "coordinates" else name
            if values.ndim == 1:
                table[prefix] = values
            for suffix in self._suffixes(name):
                table[f"{prefix}_{suffix}"] = values[:, _component(suffix)]
        return pandas.DataFrame(table, index=pandas.Index(self.id, name="id"))

    def _suffixes(self, name: str) -> tuple[str, ...]:
        values = self._fields[name]
        components = 1 if values.ndim == 1 else values.shape[1]
        if components == 1:
            return ()
        if components == 6:
            if self.dim == 3:
                return _TENSOR
            # Plane strain has none across the plane; sheets and bodies of revolution have.
            if name == "strain" and not values[:, 2].any():
                return ("xx", "yy", "xy")
            return _TENSOR[:4]
        if components <= 3:
            return _VECTOR[:components]
        return tuple(str(k) for k in range(components))

    def scalar(self, name: str) -> Array:
        """The field as one number per particle: the length of a vector; a component of a tensor has
        to be named."""
        values = self[name]
        if values.ndim == 1:
            return values
        if values.shape[1] > 3:
            raise ValueError(f"{name} has {values.shape[1]} components: name one of "
                             + ", ".join(f"{name}_{s}" for s in self._suffixes(name)))
        return np.asarray(np.linalg.norm(values, axis=1))

    def __repr__(self) -> str:
        return f"<lahar.Frame step {self.step}, {self.time:.6g} s, {len(self)} particles>"


def _component(suffix: str) -> int:
    if suffix in _VECTOR:
        return _VECTOR.index(suffix)
    return _TENSOR.index(suffix) if suffix in _TENSOR else int(suffix)
