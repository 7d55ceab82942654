import gc
import threading
import unittest

import numpy

import lahar
from case import TestCase, column


class SimulationTest(TestCase):
    def test_steps_of_python_have_the_bits_of_the_command(self):
        for analysis in ({}, {"dt": 2e-4, "mpm_scheme": "usf"}):
            case = column(**analysis)
            run = self.command(case, f"command-{len(analysis)}")
            with lahar.Simulation(case, threads=2) as sim:
                self.assert_equal_frames(sim.particles, run.frames[0])
                for frame in run.frames[1:]:
                    while sim.steps < frame.step:
                        sim.step(min(7, frame.step - sim.steps))
                    self.assert_equal_frames(sim.particles, frame)
                self.assertTrue(sim.finished)
                self.assertEqual(sim.run(), run.frames[-1].step)
                self.assertEqual(sim.sums["kinetic"], run.history.kinetic.iloc[-1])

    def test_views_show_what_frames_have_without_a_copy(self):
        with lahar.Simulation(column()) as sim:
            for _ in range(3):
                sim.step(20)
                found = {}
                for patch in sim.patches():
                    used = patch.used
                    self.assertEqual(len(used), len(patch))
                    velocity, ids = patch["velocity"], patch.id
                    self.assertFalse(velocity.flags.owndata or velocity.flags.writeable)
                    self.assertTrue(numpy.shares_memory(velocity, patch["velocity"]))
                    for p in used:
                        found[ids[p]] = (*velocity[p], *patch["stress"][p], patch["mass"][p], patch.material[p])
                    del velocity, ids
                frame = sim.particles
                self.assertEqual(sorted(found), list(frame.id))
                table = numpy.array([found[i] for i in frame.id])
                self.assertTrue((table[:, 0:2] == frame["velocity"]).all())
                self.assertTrue((table[:, 2:6] == frame["stress"][:, :4]).all())
                self.assertTrue((table[:, 6] == frame["mass"]).all())
                self.assertTrue((table[:, 7] == frame.material).all())
                del patch

    def test_no_step_is_taken_under_a_view(self):
        sim = lahar.Simulation(column())
        patches = sim.patches()
        view = patches[0]["velocity"][3:]
        with self.assertRaisesRegex(BufferError, "copies"):
            sim.step()
        kept = view.copy()
        sim.close()  # the view keeps the memory
        gc.collect()
        self.assertTrue((view == kept).all())

    def test_patches_of_an_earlier_step_are_refused(self):
        sim = lahar.Simulation(column())
        patch = sim.patches()[0]
        sim.step()
        with self.assertRaisesRegex(RuntimeError, "earlier step"):
            patch["velocity"]
        self.assertEqual({name for name, _, _ in sim.patches()[0].columns()} & {"mass", "stress"}, {"mass", "stress"})
        with self.assertRaises(KeyError):
            sim.patches()[0]["no such column"]

    def test_simulations_do_not_disturb_each_other(self):
        alone = lahar.Simulation(column())
        alone.run()
        others = [lahar.Simulation(column(), threads=1) for _ in range(2)]
        threads = [threading.Thread(target=sim.run) for sim in others]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for sim in others:
            self.assert_equal_frames(sim.particles, alone.particles)

    def test_a_step_that_fails_raises_the_message_of_the_engine(self):
        with self.assertRaises(lahar.InvalidInput):
            lahar.Simulation(column(dt=1.0))
        case = column()
        case["external_loading_conditions"]["gravity"] = [50, 0]  # out of the mesh
        sim = lahar.Simulation(case.changed({"analysis.end_time": 10.0}))
        for _ in range(2):  # no step is taken after it
            with self.assertRaisesRegex(lahar.SimulationFailed, "left the mesh"):
                sim.run()

    def test_a_step_after_the_end_is_refused(self):
        with lahar.Simulation(column(end_time=0.01)) as sim:
            last = sim.step(10**6)  # fewer, because the end comes first
            self.assertTrue(sim.finished)
            with self.assertRaisesRegex(lahar.InvalidInput, f"ended at step {last}, 0.01 s.*analysis.end_time"):
                while sim.time < 1:
                    sim.step(10)
            self.assertEqual((sim.steps, sim.step(0), sim.run()), (last, last, last))

    def test_a_closed_simulation_is_refused(self):
        sim = lahar.Simulation(column())
        sim.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            sim.step()


def staged():
    """A column that is held by a paddle, which then falls over, and is gone."""
    case = column(end_time=0.02)
    case["rigid_bodies"] = [
        {"name": "paddle", "region": {"box": {"min": [0.1, 0.0], "max": [0.13, 0.14]}}, "velocity": [0, 0]},
        {"name": "ball", "region": {"sphere": {"centre": [0.3, 0.05], "radius": 0.03}}, "density": 500,
         "friction": 0.3}]
    case["post_processing"].update({"gauge_steps": 20, "history_steps": 20, "gauges": [
        {"name": "front", "type": "front", "direction": [1, 0]},
        {"name": "paddle", "type": "force", "rigid_body": "paddle"},
        {"name": "two", "type": "track", "pset": "foot", "fields": ["velocity"]}]})
    case["sets"]["particles"] = {"foot": {"box": {"min": [0.094, 0], "max": [0.1, 0.011]}}}
    moved = [{**case["rigid_bodies"][0], "velocity": [0.3, 0]}, case["rigid_bodies"][1]]
    free = {name: value for name, value in moved[0].items() if name != "velocity"}
    case["stages"] = [{"name": "rest"}, {"name": "pull", "rigid_bodies": moved},
                      {"name": "fall", "rigid_bodies": [{**free, "density": 700}, moved[1]],
                       "analysis": {"end_time": 0.05}}]
    return case


class StagesTest(TestCase):
    def test_stages_have_the_bits_of_the_command(self):
        case = staged()
        run = self.command(case)
        with lahar.Simulation(case, threads=2) as sim:
            self.assertEqual((sim.stages, sim.stage, sim.finished), (["rest", "pull", "fall"], "rest", False))
            for stage in sim.stages:
                wanted = run.stages[stage]
                last = sim.run(stage)
                self.assertEqual((sim.stage, last, sim.stage_finished), (stage, wanted.frames[-1].step, True))
                self.assert_equal_frames(sim.particles, wanted.frames[-1])
                self.assertEqual(sim.sums["balance"], wanted.history.balance.iloc[-1])
                self.assertEqual(list(sim.gauges), list(wanted.gauges))
                for name, table in sim.gauges.items():
                    self.assertGreater(len(table), 2)
                    self.assertEqual(list(table), list(wanted.gauges[name]))
                    numpy.testing.assert_array_equal(table.to_numpy(), wanted.gauges[name].to_numpy())
                    self.assertEqual(table.attrs, wanted.gauges[name].attrs)
                self.assertEqual(list(sim.bodies), ["paddle", "ball"])
                rows = wanted.rigid_bodies
                for name, body in sim.bodies.items():
                    row = rows[rows.body == name].iloc[-1]
                    for key, values in body._asdict().items():
                        if key == "name":
                            self.assertEqual(values, name)
                            continue
                        columns = [f"{axis}" if key == "place" else f"{key}_{axis}" for axis in "xyz"]
                        self.assertEqual(list(values), list(row[columns]), (name, key))
            self.assertTrue(sim.finished)
            self.assertIn("stage fall", repr(sim))

    def test_steps_go_from_stage_to_stage(self):
        case = staged()
        whole = lahar.Simulation(case)
        whole.run()
        sim = lahar.Simulation(case)
        seen = []
        while not sim.finished:
            before = sim.stage, sim.time
            sim.step(17)
            if sim.stage != before[0]:
                self.assertGreater(before[1], sim.time)  # it begins at 0
                seen.append(sim.stage)
            if sim.stage_finished:
                self.assertAlmostEqual(sim.time, {"fall": 0.05}.get(sim.stage, 0.02))
        self.assertEqual((seen, sim.stage), (["pull", "fall"], "fall"))
        self.assert_equal_frames(sim.particles, whole.particles)
        with self.assertRaisesRegex(lahar.InvalidInput, "ended in stage fall at step"):
            sim.step()
        with self.assertRaisesRegex(lahar.InvalidInput, "stage rest has ended, fall has begun"):
            sim.run("rest")
        with self.assertRaisesRegex(lahar.InvalidInput, "no stage slide; it has: rest, pull, fall"):
            sim.run("slide")

    def test_a_view_of_the_stage_before_keeps_the_next_from_beginning(self):
        sim = lahar.Simulation(staged())
        sim.run("rest")
        patch = sim.patches()[0]
        view = patch["velocity"]
        with self.assertRaisesRegex(BufferError, "copies"):
            sim.step()
        self.assertEqual(sim.stage, "rest")
        del view
        sim.step()
        self.assertEqual((sim.stage, sim.steps), ("pull", 1))
        with self.assertRaisesRegex(RuntimeError, "earlier step"):
            patch["velocity"]

    def test_mistakes_of_later_stages_are_found_before_the_first(self):
        case = staged()
        case["stages"][2]["analysis"]["end_time"] = -1
        with self.assertRaisesRegex(lahar.InvalidInput, "end_time"):
            lahar.Simulation(case)

    def test_without_stages_bodies_and_gauges_there_are_none(self):
        sim = lahar.Simulation(column())
        self.assertEqual((sim.stages, sim.stage, sim.bodies, sim.gauges), ([], "", {}, {}))
        with self.assertRaisesRegex(lahar.InvalidInput, "no stage rest; it has: none"):
            sim.run("rest")


if __name__ == "__main__":
    unittest.main()
