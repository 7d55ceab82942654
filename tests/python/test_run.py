import json
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import time
import unittest
import warnings
from pathlib import Path

import matplotlib
import numpy

import lahar
from case import PROGRAM, SOURCE, TestCase, column

matplotlib.use("Agg")

LONG = {"end_time": 1000.0}


class RunTest(TestCase):
    def test_a_run_writes_what_the_command_writes(self):
        case = column()
        case.name = "command.json"  # from which the scenario has the name of its run folder
        command = self.command(case)
        run = case.run(self.folder / "python", progress=False)
        self.assertEqual(run.status, "finished")
        self.assertEqual(list(run.frames.steps), list(command.frames.steps))
        for a, b in zip(run.frames, command.frames):
            self.assert_equal_frames(a, b)
        for name in ("history.csv", "scenario.json", "scenario.full.json"):
            self.assertEqual((run.folder / name).read_bytes(), (command.folder / name).read_bytes(), name)

    def test_the_factor_of_safety_is_that_of_the_command(self):
        case = lahar.Scenario.read(SOURCE / "tests/verification/safety/vertical-cut.json")
        case.set("mesh.structured.cell_size", 1)
        found = case.safety(self.folder / "python", tolerance=0.05)
        case.write(self.folder / "cut.json")
        subprocess.run([PROGRAM, "safety", self.folder / "cut.json", "--tolerance", "0.05", "--quiet",
                        "-o", self.folder / "command"], check=True, stdout=subprocess.DEVNULL)
        command = lahar.Safety(self.folder / "command")
        self.assertTrue(found.trials.equals(command.trials), (found.trials, command.trials))
        stable, fails = found.bracket
        self.assertTrue(1.5 < stable < found.factor < fails < 1.9, found)
        self.assertLessEqual(fails - stable, 0.05 * stable)
        self.assertEqual(found.equilibrium.status, "finished")
        self.assertGreater(found.mechanism.frames[-1]["displacement"].max(), 0)
        self.assertEqual(found.trials.attrs["units"]["displacement"], "m")
        self.assertEqual((found.status, found.message), ("finished", ""))
        self.assertIn("'clay'", found.divided)
        self.assertEqual(found.mechanism.status, "finished")
        axes = found.plot()
        self.assertEqual(sum(len(line.get_xdata()) for line in axes.lines), len(found.trials))
        with self.assertRaisesRegex(lahar.InvalidInput, 'restart="latest".*overwrite'):
            case.safety(self.folder / "python")
        weak = self.folder / "weak"
        with self.assertRaisesRegex(lahar.SimulationFailed, "no equilibrium with full strength.*: step"):
            case.changed({"materials.clay.yield_stress": 20000}).safety(weak)
        self.assertEqual(lahar.Safety(weak).status, "failed")
        self.assertTrue(numpy.isnan(lahar.Safety(weak).factor))
        self.assertEqual(len(lahar.Safety(weak).trials), 0)
        with self.assertRaisesRegex(FileNotFoundError, "lahar.Safety reads it"):
            lahar.Run(weak)

    def test_a_search_that_was_stopped_goes_on_with_its_trials(self):
        case = lahar.Scenario.read(SOURCE / "tests/verification/safety/vertical-cut.json")
        case.set("mesh.structured.cell_size", 1)
        whole = case.safety(self.folder / "whole", tolerance=0.02, progress=False)
        shares = []

        def until_half(step, time, share):
            shares.append(share)
            return not (self.folder / "search" / "safety.csv").is_file() or len(lahar.Safety(
                self.folder / "search").trials) < 3

        found = case.safety(self.folder / "search", tolerance=0.02, progress=until_half)
        self.assertEqual(found.status, "stopped")
        self.assertTrue(0 < max(shares) < 1 and min(shares) >= 0, shares)
        known = len(found.trials)
        self.assertTrue(3 <= known < len(whole.trials), found.trials)
        self.assertTrue(found.trials.equals(whole.trials[:known]))
        found = case.safety(self.folder / "search", tolerance=0.02, restart="latest", progress=False)
        self.assertEqual((found.status, found.bracket), ("finished", whole.bracket))
        self.assertTrue(found.trials.equals(whole.trials))
        self.assert_equal_frames(found.mechanism.frames[-1], whole.mechanism.frames[-1])
        with self.assertRaisesRegex(lahar.InvalidInput, "yield_stress"):
            case.changed({"materials.clay.yield_stress": 40000}).safety(self.folder / "search", restart="latest")
        self.assertEqual(found.status, "finished")

    def test_results_are_tables_by_particle_and_by_time(self):
        run = column().run(self.folder / "run", progress=False)
        frame = run.frames.at(time=0.05)
        self.assertLess(abs(frame.time - 0.05), 0.02)
        self.assertEqual(frame.step, run.frames.at(step=frame.step).step)
        table = frame.particles
        self.assertEqual(list(table.index), sorted(table.index))
        self.assertTrue((table["velocity_x"] == frame["velocity"][:, 0]).all())
        self.assertTrue((table["stress_xy"] == frame["stress_xy"]).all())
        self.assertNotIn("stress_yz", table)
        self.assertEqual(run.history.attrs["units"]["kinetic"], "J")
        self.assertEqual(run.history.step.iloc[-1], run.frames[-1].step)
        self.assertEqual(run.scenario["materials"][0]["friction"], 22)
        with self.assertRaisesRegex(KeyError, "velocity"):
            frame["speeed"]

    def test_frames_derive_what_the_engine_derives(self):
        case = column(end_time=0.05)
        plain = case.run(self.folder / "plain", progress=False).frames[-1]
        names = plain.derived
        self.assertTrue({"speed", "von_mises_stress", "mean_stress"} <= set(names), names)
        self.assertFalse(set(names) & set(plain))
        case["post_processing"]["vtk"] = [*names, "deviatoric_stress"]
        asked = case.run(self.folder / "asked", progress=False).frames[-1]
        self.assertEqual(asked.derived, [])
        for name in names:
            scale = abs(asked[name]).max()
            numpy.testing.assert_allclose(plain[name], asked[name], rtol=1e-9, atol=1e-12 * scale, err_msg=name)
            self.assertEqual(plain.unit(name), asked.units[name])
        with self.assertRaisesRegex(KeyError, '"vtk".*names it before the run'):
            plain["deviatoric_stress_xy"]
        self.assertTrue((asked["deviatoric_stress_xy"] == plain["stress_xy"]).all())
        with self.assertRaisesRegex(KeyError, "follows from pore_pressure, which this frame does not have"):
            plain["total_mean_stress"]
        self.assertTrue((plain["id"] == plain.id).all() and (plain["material"] == plain.material).all())

    def test_the_derived_fields_are_those_of_the_engine(self):
        table = (SOURCE / "physics/particles/derived_fields.h").read_text()
        scalars = re.findall(r'^    \{"(\w+)", "([^"]*)", 1, "([^"]+)"', table, re.M)
        known = [(name, one.unit, " ".join(one.columns)) for name, one in lahar.frame._DERIVED.items()]
        self.assertEqual(sorted(known), sorted(scalars))
        others = re.findall(r'^    \{"(\w+)", "[^"]*", (?:6, "[^"]+"|1, "")', table, re.M)
        self.assertEqual(sorted(others), sorted(lahar.frame._ONLY_ASKED))

    def test_a_plot_shows_the_particles_of_the_frame(self):
        run = column().run(self.folder / "run", progress=False)
        axes = run.plot("velocity", time=0.05)
        dots = axes.collections[0]
        frame = run.frames.at(time=0.05)
        self.assertTrue((dots.get_offsets() == frame["coordinates"]).all())
        self.assertTrue((dots.get_array() == numpy.linalg.norm(frame["velocity"], axis=1)).all())
        self.assertEqual(dots.colorbar.ax.get_ylabel(), "velocity [m/s]")
        for field, label in (("von_mises_stress", "von_mises_stress [Pa]"), ("stress_xy", "stress_xy [Pa]"),
                             ("material", "material")):
            self.assertEqual(run.plot(field).collections[0].colorbar.ax.get_ylabel(), label)
        with self.assertRaisesRegex(ValueError, "stress_xx"):
            run.plot("stress")

    def test_gauges_and_maps_are_read_with_their_units(self):
        run = column().run(self.folder / "run", progress=False)
        self.assertEqual((len(run.gauges), len(run.maps)), (0, 0))
        about = {**run.manifest, "maps": [{"name": "max_thickness", "unit": "m"}]}
        (run.folder / "manifest.json").write_text(json.dumps(about))
        (run.folder / "gauges").mkdir()
        (run.folder / "gauges" / "toe.csv").write_text("step [-],time [s],height [m]\n0,0,0.1\n5,0.5,0.25\n")
        (run.folder / "maps").mkdir()
        (run.folder / "maps" / "max_thickness.asc").write_text(
            "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 2\nNODATA_value -9999\n1 2 3\n4 -9999 6\n")
        toe = run.gauges["toe"]
        self.assertEqual(list(toe.height), [0.1, 0.25])
        self.assertEqual(toe.attrs["units"], {"step": "-", "time": "s", "height": "m"})
        thickness = run.maps["max_thickness"]
        numpy.testing.assert_array_equal(thickness.values, [[4, numpy.nan, 6], [1, 2, 3]])
        self.assertEqual((list(thickness.x), list(thickness.y)), ([11, 13, 15], [21, 23]))
        self.assertEqual((thickness.name, thickness.unit), ("max_thickness", "m"))
        self.assertEqual(thickness.plot().collections[0].colorbar.ax.get_ylabel(), "max_thickness [m]")
        with self.assertRaisesRegex(KeyError, "toe"):
            run.gauges["heel"]

    def test_earlier_results_are_kept_unless_they_may_be_replaced(self):
        case = column(end_time=0.01)
        case.run(self.folder / "run", progress=False)
        with self.assertRaisesRegex(lahar.InvalidInput, 'restart="latest".*overwrite=True') as raised:
            case.run(self.folder / "run", progress=False)
        self.assertNotIn("--", str(raised.exception))
        self.assertEqual(case.run(self.folder / "run", overwrite=True, progress=False).status, "finished")

    def test_progress_may_stop_a_run_which_then_goes_on(self):
        case = column()
        whole = case.run(self.folder / "whole", progress=False)
        shares = []

        def stop(step, time, share):
            shares.append((step, time, share))
            return False

        run = case.run(self.folder / "run", progress=stop)
        self.assertEqual((run.status, run.message), ("stopped", "stopped by the calling program"))
        self.assertEqual(len(shares), 1)
        self.assertAlmostEqual(shares[0][1] / 0.1, shares[0][2])
        run = case.run(self.folder / "run", restart="latest", progress=False)
        self.assertEqual(run.status, "finished")
        self.assert_equal_frames(run.frames[-1], whole.frames[-1])

    def test_an_exception_of_the_progress_function_stops_the_run(self):
        def fail(step, time, share):
            raise ZeroDivisionError("from progress")

        with self.assertRaisesRegex(ZeroDivisionError, "from progress"):
            column(**LONG).run(self.folder / "run", progress=fail)
        self.assertEqual(lahar.Run(self.folder / "run").status, "stopped")

    def test_a_run_that_fails_raises_and_keeps_its_frames(self):
        case = column(**LONG)
        case["external_loading_conditions"]["gravity"] = [50, 0]
        with self.assertRaisesRegex(lahar.SimulationFailed, "left the mesh"):
            case.run(self.folder / "run", progress=False)
        run = lahar.Run(self.folder / "run")
        self.assertEqual(run.status, "failed")
        self.assertGreater(len(run.frames), 0)

    def test_stages_of_an_earlier_run_do_not_stay(self):
        case = column(end_time=0.02)
        out = self.folder / "run"
        case.run(out, progress=False)
        case["stages"] = [{"name": "one"}, {"name": "two"}]
        with self.assertRaisesRegex(lahar.InvalidInput, "holds the results of an earlier run"):
            case.run(out, progress=False)
        self.assertEqual(list(case.run(out, overwrite=True, progress=False).stages), ["one", "two"])
        self.assertFalse((out / "manifest.json").exists())
        (out / "two" / "notes.txt").write_text("mine")
        self.assertEqual(list(case.run(out, overwrite=True, progress=False).stages), ["one", "two"])
        case["stages"] = [{"name": "one"}, {"name": "three"}]
        with self.assertRaisesRegex(lahar.InvalidInput, "a stage two, which the scenario does not have"):
            case.run(out, restart="latest", progress=False)
        self.assertEqual(list(case.run(out, overwrite=True, progress=False).stages), ["one", "three"])
        self.assertEqual([path.name for path in (out / "two").iterdir()], ["notes.txt"])
        del case["stages"]
        self.assertEqual(case.run(out, overwrite=True, progress=False).stages, {})
        self.assertFalse((out / "one").exists())

    def test_stages_are_runs_of_their_own(self):
        case = column()
        case["stages"] = [{"name": "first", "analysis": {"end_time": 0.01}}, {"name": "second"}]
        run = case.run(self.folder / "run", progress=False)
        self.assertEqual(list(run.stages), ["first", "second"])
        self.assertEqual(run.status, "finished")
        self.assertEqual(run.stages["first"].frames[-1].time, 0.01)
        with self.assertRaisesRegex(AttributeError, "stages"):
            run.frames
        with self.assertRaisesRegex(KeyError, "no stage third; it has: first, second"):
            run.stages["third"]
        with self.assertRaisesRegex(lahar.FileError, "no rigid bodies; its tables are: history.csv"):
            run.stages["first"].rigid_bodies
        shutil.rmtree(self.folder / "run" / "second")
        self.assertEqual(lahar.Run(self.folder / "run").status, "stopped")

    def test_a_run_whose_energy_does_not_close_says_so(self):
        """A block that falls on a floor: nodes with hardly any mass take energy along with usl and flip."""
        case = lahar.Scenario({
            "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 2]},
                     "boundary_conditions": {"walls": [{"nset": "floor", "normal": [0, 1]}]}},
            "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
            "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "m",
                                         "region": {"box": {"min": [0.3, 0.1], "max": [0.7, 0.7]}}}}],
            "materials": [{"name": "m", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                           "poisson_ratio": 0.3}],
            "external_loading_conditions": {"gravity": [0, -10]},
            "analysis": {"end_time": 2, "shape_functions": "gimp", "mpm_scheme": "usl", "velocity_update": "flip"}})
        said = [text for text in self.command(case, "usl").manifest["warnings"] if "does not close" in text]
        self.assertEqual(len(said), 1)
        self.assertRegex(said[0], r"J were lost without a trace, .*half the time step.*musl")
        for key in ("shape_functions", "mpm_scheme", "velocity_update"):
            del case["analysis"][key]
        self.assertFalse([text for text in self.command(case, "default").manifest["warnings"]
                          if "does not close" in text])

    def test_a_run_into_which_more_came_than_was_said_says_so(self):
        """Water that is poured leaves its cells faster than with its velocity, but where nodes hold that."""
        case = lahar.Scenario({
            "mesh": {"structured": {"cell_size": 0.1, "extent": [0.4, 2]}, "boundary_conditions": {}},
            "sets": {kind: {"inlet": {"box": {"min": [0, 1.9], "max": [0.4, 2]}}} for kind in ("cells", "nodes")},
            "particles": [{"generator": {"type": "inject", "cset": "inlet", "nparticles_per_dir": 2,
                                         "velocity": [0, -0.5], "material": "water"}}],
            "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e5,
                           "dynamic_viscosity": 1e-3}],
            "external_loading_conditions": {"gravity": [0, -10]},
            "analysis": {"end_time": 0.5}})

        def said(name):
            return [text for text in self.command(case, name).manifest["warnings"] if "were injected" in text]

        free = said("free")
        self.assertEqual(len(free), 1)
        self.assertRegex(free[0], r"kg were injected where velocity, area and time say 100 kg.*faster")
        case["mesh"]["boundary_conditions"]["velocity_constraints"] = [{"nset": "inlet", "dir": "y", "velocity": -0.5}]
        self.assertEqual(said("held"), [])

    def test_the_engine_warns_by_python_warnings(self):
        case = column(end_time=0.001)
        case["materials"][0]["density"] = 1.6
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            case.run(self.folder / "run", progress=False)
        texts = [str(one.message) for one in caught if issubclass(one.category, lahar.LaharWarning)]
        self.assertTrue(any("density" in text for text in texts), texts)
        self.assertTrue(all(one.filename == __file__ for one in caught if one.category is lahar.LaharWarning))

    def test_who_moves_through_cells_of_second_order_is_told_of_their_stresses(self):
        x = [(i / 2, j / 2) for j in range(7) for i in range(7)]
        at = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
        cells = [[2 * i + a + 7 * (2 * j + b) for a, b in at] for j in range(3) for i in range(3)]
        (self.folder / "mesh.txt").write_text("\n".join(
            ["49 9", *(f"{a} {b}" for a, b in x), *(" ".join(map(str, cell)) for cell in cells)]))
        case = column(end_time=0.25)
        case["mesh"] = {"mesh": str(self.folder / "mesh.txt"), "cell_type": "ED2Q9"}
        case["particles"][0]["generator"]["region"] = {"box": {"min": [1, 1.5], "max": [2, 2.5]}}
        del case["sets"]
        said = [text for text in self.command(case).manifest["warnings"] if "second order" in text]
        self.assertEqual(len(said), 1)
        self.assertRegex(said[0], "moved by up to 0.31 of a cell")
        case["analysis"]["end_time"] = 0.05
        self.assertFalse([text for text in self.command(case, "short").manifest["warnings"]
                          if "second order" in text])

    def test_a_missing_folder_is_not_a_run(self):
        with self.assertRaises(FileNotFoundError):
            lahar.Run(self.folder)


class InterruptTest(TestCase):
    """Ctrl-C while another Python runs a case."""

    def interrupted(self, code):
        """What that Python prints, after a signal that comes when steps are taken; and how long it
        takes to end."""
        prepare = textwrap.dedent(f"""
            import signal, sys, lahar
            sys.path.insert(0, {str(Path(__file__).parent)!r})
            from case import column
            signal.signal(signal.SIGINT, signal.default_int_handler)
            case, folder = column(end_time=1000.0), {str(self.folder / "run")!r}
        """)
        child = subprocess.Popen([sys.executable, "-c", prepare + textwrap.dedent(code)],
                                 stdout=subprocess.PIPE, text=True)
        self.addCleanup(child.stdout.close)
        self.assertEqual(child.stdout.readline(), "runs\n")
        time.sleep(0.3)
        child.send_signal(signal.SIGINT)
        begin = time.monotonic()
        printed = child.stdout.read()
        child.wait()
        return printed, time.monotonic() - begin

    def test_a_run_stops_within_a_second_with_a_checkpoint(self):
        printed, seconds = self.interrupted("""
            said = []
            def tell(step, time, share):
                if not said:
                    said.append(print("runs", flush=True))
            try:
                case.run(folder, progress=tell)
            except KeyboardInterrupt:
                print("interrupted", signal.getsignal(signal.SIGINT) is signal.default_int_handler)
        """)
        self.assertEqual(printed, "interrupted True\n")
        self.assertLess(seconds, 1.5)  # and Python ends
        run = lahar.Run(self.folder / "run")
        self.assertEqual((run.status, run.message), ("stopped", f"signal {int(signal.SIGINT)}"))
        self.assertTrue(list((self.folder / "run" / "checkpoints").glob("*.h5")))
        self.assertGreater(run.frames[-1].step, 0)

    def test_steps_stop_and_the_simulation_can_go_on(self):
        printed, seconds = self.interrupted("""
            sim = lahar.Simulation(case)
            print("runs", flush=True)
            try:
                sim.run()
            except KeyboardInterrupt:
                before = sim.steps
                print(before > 0, sim.step(5) - before)
        """)
        self.assertEqual(printed, "True 5\n")
        self.assertLess(seconds, 1.5)


if __name__ == "__main__":
    unittest.main()
