"""The solution that examples/howland.py compares with. Exit status 77: a Python package is missing."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
sys.dont_write_bytecode = True
try:
    import numpy as np
    import howland
except ImportError as error:
    print(error)
    sys.exit(77)


class StripTest(unittest.TestCase):
    def setUp(self):
        self.strip = howland.Strip(howland.WIDTH, howland.LENGTH, howland.HOLE)

    def test_the_hole_is_free_of_traction(self):
        theta = np.linspace(0, np.pi / 2, 50)
        n = np.column_stack([np.cos(theta), np.sin(theta)])
        xx, yy, xy = self.strip.stress(howland.HOLE * n).T
        np.testing.assert_allclose(xx * n[:, 0] + xy * n[:, 1], 0, atol=1e-12)
        np.testing.assert_allclose(xy * n[:, 0] + yy * n[:, 1], 0, atol=1e-12)

    def test_the_outer_edges_carry_the_load_between_the_fitted_points_too(self):
        y = np.linspace(0, howland.WIDTH / 2, 777)
        end = self.strip.stress(np.column_stack([np.full_like(y, howland.LENGTH / 2), y]))
        np.testing.assert_allclose(end[:, 0], 1, atol=1e-4)
        np.testing.assert_allclose(end[:, 2], 0, atol=1e-4)
        x = np.linspace(0, howland.LENGTH / 2, 777)
        side = self.strip.stress(np.column_stack([x, np.full_like(x, howland.WIDTH / 2)]))
        np.testing.assert_allclose(side[:, 1:], 0, atol=1e-4)

    def test_the_ligament_carries_the_whole_load(self):
        nodes, weights = np.polynomial.legendre.leggauss(60)
        half = (howland.WIDTH / 2 - howland.HOLE) / 2
        y = howland.HOLE + half * (1 + nodes)
        xx = self.strip.stress(np.column_stack([0 * y, y]))[:, 0]
        self.assertAlmostEqual(half * weights @ xx, howland.WIDTH / 2, delta=1e-6)

    def test_a_wide_plate_gives_kirsch(self):
        wide = howland.Strip(100, 160, 0.5)
        stress = wide.stress([[0, 0.5], [0.5, 0]])
        self.assertAlmostEqual(stress[0, 0], 3, delta=2e-3)
        self.assertAlmostEqual(stress[1, 1], -1, delta=2e-3)

    def test_a_long_strip_gives_howland_within_one_percent(self):
        long = howland.Strip(howland.WIDTH, 3 * howland.WIDTH, howland.HOLE)
        stress = long.stress([[0, 0.5], [0.5, 0]])
        self.assertAlmostEqual(stress[0, 0], howland.HOWLAND["A xx"], delta=0.0314)
        self.assertAlmostEqual(stress[1, 1], howland.HOWLAND["B yy"], delta=0.0111)

    def test_this_plate_agrees_with_finite_elements(self):
        # Bilinear elements, 80, 160 and 320 cells per direction, extrapolated to zero size.
        stress = self.strip.stress([[0, 0.5], [0.5, 0]])
        self.assertAlmostEqual(stress[0, 0], 3.1757, delta=1e-4)
        self.assertAlmostEqual(stress[1, 1], -1.1481, delta=1e-4)


if __name__ == "__main__":
    unittest.main()
