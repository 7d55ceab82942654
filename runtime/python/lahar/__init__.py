"""Lahar from Python: build and run scenarios, step them, and read what runs wrote.

    import lahar

    case = lahar.Scenario.read("dam-break.json")
    case["analysis"]["end_time"] = 0.1
    run = case.run("results/dam")            # as `lahar run`: a run folder with frames
    run.plot("velocity")                     # the last frame
    run.frames[-1].particles                 # pandas, by particle id

    sim = lahar.Simulation(case)             # in the process, without files
    while sim.time < 0.05:
        sim.step(10)
    sim.particles["velocity"]                # numpy, by particle id

    study = lahar.study("study", case, {"materials.0.friction": [20, 25, 30]}, workers=2)
    study.table(runout=lambda run: run.frames[-1]["coordinates"][:, 0].max())

    slope = lahar.Scenario.read("slope-safety.json")
    slope.safety("results/slope").factor     # as `lahar safety`: by strength reduction
"""
from ._engine import commit as __commit__
from ._engine import version as __version__
from .errors import FileError, InvalidInput, LaharError, LaharWarning, Problem, SimulationFailed
from .frame import Frame
from .results import Map, Run, Safety
from .scenario import Check, Scenario, reference, schema
from .simulation import Body, Simulation
from .studies import Study, study

__all__ = [
    "Body", "Check", "FileError", "Frame", "InvalidInput", "LaharError", "LaharWarning", "Map", "Problem", "Run",
    "Safety", "Scenario", "Simulation", "SimulationFailed", "Study", "__commit__", "__version__", "reference", "schema",
    "study",
]
