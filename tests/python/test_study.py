import os
import signal
import subprocess
import sys
import textwrap
import time
import unittest
from pathlib import Path

import lahar
from case import SOURCE, TestCase, column, slow_column


def runout(run):
    return run.frames[-1]["coordinates"][:, 0].max()


class StudyTest(TestCase):
    def test_a_study_is_a_table_of_the_runs_that_single_runs_would_be(self):
        angles = [10, 40]
        study = lahar.study(self.folder / "study", column(), {"materials.0.friction": angles}, workers=2,
                            progress=False)
        table = study.table(runout=runout)
        self.assertEqual(list(table["materials.0.friction"]), angles)
        self.assertEqual(list(table.status), ["finished"] * 2)
        for angle, value, one in zip(angles, table.runout, study.runs):
            run = column().changed({"materials.0.friction": angle}).run(self.folder / str(angle), progress=False)
            self.assertEqual(value, runout(run))
            self.assert_equal_frames(one.run.frames[-1], run.frames[-1])
        self.assertGreater(table.runout[0], table.runout[1])

    def test_a_function_is_told_whenever_a_run_has_ended(self):
        said = []
        lahar.study(self.folder / "study", column(end_time=0.02), {"materials.sand.friction": [20, 30]},
                    workers=1, progress=said.append)
        self.assertEqual(said, ["study: 0 of 2 runs done, 1 running (0 %)",
                                "study: 1 of 2 runs done, 1 running (0 %)", "study: 2 of 2 runs done"])

    def test_finished_runs_are_kept_and_new_ones_are_added(self):
        case, folder = column(end_time=0.02), self.folder / "study"
        first = lahar.study(folder, case, {"materials.0.friction": [20, 30]}, progress=False)
        written = {one.folder: (one.folder / "manifest.json").stat().st_mtime_ns for one in first.runs}
        more = lahar.study(folder, case, {"materials.0.friction": [20, 25, 30], "analysis.end_time": [0.02]},
                           progress=False)
        self.assertEqual(len(more), 3)
        kept = [one for one in more.runs if one.folder in written]
        self.assertEqual(len(kept), 2)
        self.assertEqual([one.folder.name[:12] for one in first.runs], ["friction=20_", "friction=30_"])
        self.assertTrue(more.runs[1].folder.name.startswith("friction=25_end_time=0.02_"))
        for one in kept:
            self.assertEqual((one.folder / "manifest.json").stat().st_mtime_ns, written[one.folder])
        self.assertEqual(len(lahar.Study(folder).table()), 3)

    def test_runs_that_fail_or_are_not_valid_are_in_the_table_with_the_reason(self):
        study = lahar.study(self.folder / "study", column(), [
            {"external_loading_conditions.gravity": [50, 0], "analysis.end_time": 10.0},
            {"materials.0.friction": 95},
            {"materials.0.friction": 25}], progress=False)
        table = study.table(runout=runout)
        self.assertEqual(list(table.status), ["failed", "invalid", "finished"])
        self.assertIn("left the mesh", table.message[0])
        self.assertIn("/materials/0/friction", table.message[1])
        self.assertTrue(table.runout[:2].isna().all())
        self.assertGreater(table.runout[2], 0.1)

    def test_another_side_file_runs_the_case_again(self):
        case = column(end_time=0.01)
        case.folder = self.folder
        stl = self.folder / "box.stl"
        stl.write_text(box_stl(0.1))
        case["mesh"]["structured"] = {"cell_size": 0.02, "extent": [0.4, 0.2, 0.16]}
        case["external_loading_conditions"]["gravity"] = [0, 0, -9.81]
        case["geometry"] = {"box": {"solid": "box.stl"}}
        case["particles"][0]["generator"]["region"] = {"inside": "box"}
        case["sets"]["nodes"] = {"floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
                                 "middle": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}}}
        study = lahar.study(self.folder / "study", case, {"analysis.end_time": [0.01]}, progress=False)
        mass = study.runs[0].run.history.mass.iloc[-1]
        stl.write_text(box_stl(0.06))
        study = lahar.study(self.folder / "study", case, {"analysis.end_time": [0.01]}, progress=False)
        self.assertLess(study.runs[0].run.history.mass.iloc[-1], 0.8 * mass)

    def test_a_study_that_was_killed_goes_on_from_its_checkpoints(self):
        code = textwrap.dedent(f"""
            import sys, lahar
            sys.path.insert(0, {str(Path(__file__).parent)!r})
            from case import slow_column
            lahar.study({str(self.folder / "study")!r}, slow_column(),
                        {{"materials.0.friction": [20, 30]}}, workers=2, progress=False)
        """)
        child = subprocess.Popen([sys.executable, "-c", code])
        while len(list(self.folder.glob("study/*/history.csv"))) < 2:
            time.sleep(0.05)
        time.sleep(0.5)
        child.kill()
        child.wait()
        end = time.monotonic() + 10
        while time.monotonic() < end:  # the runs notice, and stop with a checkpoint
            states = [one.status for one in lahar.Study(self.folder / "study")]
            if states == ["stopped"] * 2:
                break
            time.sleep(0.05)
        self.assertEqual(states, ["stopped"] * 2)
        self.assertEqual(subprocess.run([sys.executable, "-c", code]).returncode, 0)
        for one in lahar.Study(self.folder / "study"):
            self.assertEqual(one.status, "finished")
            self.assertEqual(len(one.run.manifest["restarts"]), 1)
            whole = slow_column().changed(one.parameters).run(
                self.folder / str(one.parameters["materials.0.friction"]), progress=False)
            self.assert_equal_frames(one.run.frames[-1], whole.frames[-1])

    def test_ctrl_c_stops_all_runs_with_checkpoints(self):
        code = textwrap.dedent(f"""
            import signal, sys, lahar
            sys.path.insert(0, {str(Path(__file__).parent)!r})
            from case import column
            signal.signal(signal.SIGINT, signal.default_int_handler)
            lahar.study({str(self.folder / "study")!r}, column(end_time=1000.0),
                        {{"materials.0.friction": [20, 30, 40]}}, workers=2, progress=False)
        """)
        child = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
        while len(list(self.folder.glob("study/*/history.csv"))) < 2:
            time.sleep(0.05)
        child.send_signal(signal.SIGINT)
        self.assertIn("KeyboardInterrupt", child.communicate()[1])
        states = [one.status for one in lahar.Study(self.folder / "study")]
        self.assertEqual(states, ["stopped", "stopped", "waiting"])


class SafetyStudyTest(TestCase):
    def test_a_study_of_factors_of_safety_is_a_table_of_them(self):
        case = lahar.Scenario.read(SOURCE / "tests/verification/safety/vertical-cut.json")
        case.set("mesh.structured.cell_size", 1)
        folder, values = self.folder / "study", {"materials.clay.yield_stress": [50000, 60000, 20000]}
        study = lahar.study(folder, case, values, safety={"tolerance": 0.1}, progress=False)
        table = study.table(trials=lambda found: len(found.trials))
        self.assertEqual(list(table.status), ["finished", "finished", "failed"])
        self.assertIn("no equilibrium with full strength", table.message[2])
        self.assertAlmostEqual(table.factor[1] / table.factor[0], 1.2, delta=0.1)
        self.assertTrue((table.stable < table.factor)[:2].all() and (table.factor < table.fails)[:2].all())
        self.assertTrue(table.factor[2:].isna().all())
        single = case.changed({"materials.clay.yield_stress": 50000}).safety(
            self.folder / "single", tolerance=0.1, progress=False)
        self.assertEqual((table.factor[0], table.trials[0]), (single.factor, len(single.trials)))

        written = (study.runs[0].safety.equilibrium.folder / "manifest.json").stat().st_mtime_ns
        narrow = lahar.study(folder, case, values, safety={"tolerance": 0.02}, progress=False)
        self.assertEqual((narrow.runs[0].safety.equilibrium.folder / "manifest.json").stat().st_mtime_ns, written)
        more = narrow.table(trials=lambda found: len(found.trials))
        self.assertGreater(more.trials[0], table.trials[0])
        self.assertLessEqual(more.fails[0] - more.stable[0], 0.02 * more.stable[0])
        # The same study of plain runs has other folders.
        plain = lahar.study(folder, case, {"materials.clay.yield_stress": [50000]}, progress=False)
        self.assertEqual(list(plain.table().status), ["finished"])
        self.assertNotIn(plain.runs[0].folder, [one.folder for one in narrow.runs])
        with self.assertRaisesRegex(ValueError, "safety does not know tolerence; it knows: tolerance, most"):
            lahar.study(folder, case, values, safety={"tolerence": 0.1})


class ExampleTest(TestCase):
    def test_twenty_friction_angles_become_a_plot_in_25_lines(self):
        script = SOURCE / "examples" / "study.py"
        lines = [line for line in script.read_text().splitlines() if line.strip()]
        self.assertLessEqual(len(lines), 25)
        environment = {**os.environ, "MPLBACKEND": "Agg"}
        subprocess.run([sys.executable, script, "--end-time", "0.02"], cwd=self.folder, env=environment, check=True)
        table = lahar.Study(self.folder / "results" / "study").table()
        self.assertEqual(list(table.status), ["finished"] * 20)
        self.assertTrue((self.folder / "results" / "study.png").is_file())


def box_stl(height):
    """A box of 0.1 x 0.1 on the floor."""
    corners = [(x, y, z) for z in (0.0, height) for y in (0.0, 0.1) for x in (0.0, 0.1)]
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7),
             (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    text = "solid box\n"
    for face in faces:
        points = "".join("vertex {} {} {}\n".format(*corners[k]) for k in face)
        text += f"facet normal 0 0 0\nouter loop\n{points}endloop\nendfacet\n"
    return text + "endsolid box\n"


if __name__ == "__main__":
    unittest.main()
