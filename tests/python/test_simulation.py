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

    def test_a_closed_simulation_and_stages_are_refused(self):
        sim = lahar.Simulation(column())
        sim.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            sim.step()
        case = column()
        case["stages"] = [{"name": "first"}]
        with self.assertRaisesRegex(lahar.InvalidInput, "stages"):
            lahar.Simulation(case)


if __name__ == "__main__":
    unittest.main()
