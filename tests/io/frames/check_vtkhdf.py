#!/usr/bin/python3
"""Check with VTK's own readers, which are ParaView's, that a frame and its .vtu export open.

    check_vtkhdf.py FRAME.hdf FRAME.vtu

Both must give the same points, vertex cells and arrays, to the last bit; a run's frame has the particles in the order
of its patches, the export by ascending id. Exit status 77: VTK for Python is missing (Debian: python3-vtk9); where
CI=true that is a failure.
"""

import os
import sys

try:
    import numpy
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(f"VTK cannot be asked: {missing} (Debian: python3-vtk9)")
    sys.exit(1 if os.environ.get("CI") == "true" else 77)


def read(reader, path):
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(path))
    reader.SetFileName(str(path))
    assert reader.CanReadFile(str(path)), f"{path}: refused by {reader.GetClassName()}"
    reader.Update()
    assert not errors, f"{path}: {reader.GetClassName()} reported an error"
    return reader.GetOutput()


def read_frame(path):
    return read(vtk.vtkHDFReader(), path)


def read_vtu(path):
    return read(vtk.vtkXMLUnstructuredGridReader(), path)


def arrays(data):
    names = [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())]
    return {name: vtk_to_numpy(data.GetArray(name)) for name in names}


def points(grid):
    return vtk_to_numpy(grid.GetPoints().GetData())


def same(a, b):
    """Bits; an export has 64 of them where a frame may have 32."""
    return a.astype(b.dtype).tobytes() == b.tobytes()


def compare(a, b):
    """The grids of a frame and of its export."""
    n = a.GetNumberOfPoints()
    assert n > 0 and b.GetNumberOfPoints() == n
    for grid in (a, b):
        assert grid.GetNumberOfCells() == n
        assert {grid.GetCellType(i) for i in range(n)} == {vtk.VTK_VERTEX}
        assert all(grid.GetCell(i).GetPointId(0) == i for i in (0, n // 2, n - 1))
    in_a, in_b = arrays(a.GetPointData()), arrays(b.GetPointData())
    order = numpy.argsort(in_a["id"])
    assert same(points(a)[order], points(b))
    assert set(in_a) == set(in_b), (sorted(in_a), sorted(in_b))
    for name, values in in_a.items():
        assert same(values[order], in_b[name]), name
    assert in_a["stress"].shape == (n, 6) and in_a["velocity"].shape == (n, 3)
    fields_a, fields_b = arrays(a.GetFieldData()), arrays(b.GetFieldData())
    assert fields_a["time"][0] == fields_b["TimeValue"][0]
    assert fields_a["step"][0] == fields_b["step"][0]


if __name__ == "__main__":
    compare(read_frame(sys.argv[1]), read_vtu(sys.argv[2]))
