"""A small case that the tests run, and where the program and temporary folders are."""
import os
import subprocess
import tempfile
import unittest
import warnings
from pathlib import Path

import lahar

SOURCE = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("LAHAR_PROGRAM", "lahar")


def column(**analysis):
    """A column of sand that collapses: 400 particles, about 300 steps."""
    return lahar.Scenario({
        "title": "Column",
        "mesh": {
            "structured": {"origin": [0, 0], "cell_size": 0.01, "extent": [0.4, 0.16]},
            "boundary_conditions": {"velocity_constraints": [
                {"nset": "middle", "dir": "x", "velocity": 0},
                {"nset": "floor", "dir": "x", "velocity": 0},
                {"nset": "floor", "dir": "y", "velocity": 0}]},
        },
        "sets": {"nodes": {
            "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
            "middle": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
        "particles": [{"generator": {
            "type": "region", "region": {"box": {"min": [0, 0], "max": [0.1, 0.1]}}, "per_cell": 2,
            "material": "sand"}}],
        "materials": [{
            "name": "sand", "type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e6,
            "poisson_ratio": 0.3, "friction": 22, "dilation": 0, "cohesion": 0, "tension_cutoff": 0,
            "softening": False}],
        "external_loading_conditions": {"gravity": [0, -9.81]},
        "analysis": {"end_time": 0.1, **analysis},
        "post_processing": {"output_steps": 50},
    })


def slow_column():
    """The same in a hundred thousand steps, with few frames."""
    return column(end_time=0.2, dt=2e-6).set("post_processing.output_steps", 20000)


class TestCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lahar-python-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        catch = warnings.catch_warnings()
        catch.__enter__()
        self.addCleanup(catch.__exit__, None, None, None)
        warnings.simplefilter("ignore", lahar.LaharWarning)

    def command(self, case, name="command", *options):
        """The run of the program."""
        file = self.folder / f"{name}.json"
        case.write(file)
        subprocess.run([PROGRAM, "run", file, "-q", "-o", self.folder / name, *options], check=True)
        return lahar.Run(self.folder / name)

    def assert_equal_frames(self, a, b):
        """To the last bit."""
        self.assertEqual((a.step, a.time, a.id.tobytes(), a.material.tobytes(), list(a)),
                         (b.step, b.time, b.id.tobytes(), b.material.tobytes(), list(b)))
        for name in a:
            self.assertEqual(a[name].tobytes(), b[name].tobytes(), name)
