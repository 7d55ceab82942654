"""The particles at one step."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Iterator, Union

import numpy as np
import numpy.typing as npt

from . import _engine

if TYPE_CHECKING:
    import pandas

Array = npt.NDArray[Any]

_VECTOR = ("x", "y", "z")
_TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")


class Frame:
    """The particles at one step, by ascending id: `frame["velocity"]` is a numpy array.

    Vectors have a column for each dimension, tensors six: xx yy zz xy yz xz. One component is
    `frame["velocity_x"]` or `frame["stress_xy"]`. `in` and iteration tell the names of fields.
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
        field, _, suffix = name.rpartition("_")
        if field in self._fields and (suffix in self._suffixes(field)
                                      or name == "strain_zz"):
            return self._fields[field][:, _component(suffix)]
        raise KeyError(f"{name}: the fields are {', '.join(self._fields)}, "
                       "and their components such as velocity_x")

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
