import json
import unittest

import numpy

import lahar
from case import SOURCE, TestCase, column


class ScenarioTest(TestCase):
    def test_a_valid_scenario_tells_what_it_would_run(self):
        (check,) = column().check()
        self.assertEqual((check.particles, check.dim, check.stage), (400, 2, ""))
        self.assertLess(0, check.dt)
        self.assertLessEqual(check.dt, check.dt_limit)
        self.assertEqual(check.full["analysis"]["end_time"], 0.1)

    def test_an_unknown_key_is_an_error_with_its_place_and_the_nearest_key(self):
        case = column()
        case["materials"][0]["frction"] = 30
        case["analysis"]["end_time"] = -1
        with self.assertRaises(lahar.InvalidInput) as raised:
            case.check()
        places = {problem.where: problem for problem in raised.exception.problems}
        self.assertIn("/materials/0/frction", places)
        self.assertIn("friction", places["/materials/0/frction"].hint)
        self.assertIn("/analysis/end_time", places)
        self.assertIn("frction", str(raised.exception))
        self.assertIsInstance(raised.exception, ValueError)

    def test_a_file_with_comments_is_read_as_the_program_reads_it(self):
        file = SOURCE / "examples" / "dam-break.json"
        case = lahar.Scenario.read(file)
        self.assertEqual(case["materials"][0]["name"], "water")
        (check,) = case.check()
        self.assertEqual(check.full["title"], "Dam break")

    def test_a_file_that_is_not_json_is_refused_with_the_line(self):
        file = self.folder / "case.json"
        file.write_text('{"mesh": {},\n "analysis" 3}')
        with self.assertRaises(lahar.InvalidInput) as raised:
            lahar.Scenario.read(file)
        self.assertEqual(raised.exception.problems[0].line, 2)

    def test_values_are_set_by_path_in_a_copy(self):
        case = column()
        other = case.changed({"materials.0.friction": 30, "/analysis/end_time": 0.2, "analysis.damping.type": "none"})
        self.assertEqual(case["materials"][0]["friction"], 22)
        self.assertEqual(other["materials"][0]["friction"], 30)
        self.assertEqual(other["analysis"], {"end_time": 0.2, "damping": {"type": "none"}})
        for path in ("materials.1.friction", "materials.clay.friction", "title.x"):
            with self.assertRaises(KeyError, msg=path):
                case.set(path, 1)

    def test_entries_of_lists_have_names_and_none_removes_a_key(self):
        case = column().set("materials.sand.friction", 30)
        self.assertEqual(case["materials"][0]["friction"], 30)
        self.assertNotIn("softening", case.set("materials.sand.softening", None)["materials"][0])
        with self.assertRaisesRegex(KeyError, "no entry is named 'clay'; there are: sand"):
            case.set("materials.clay.friction", 1)
        for path in ("materials.sand.frction", "sets.elements.all"):
            with self.assertRaisesRegex(KeyError, "to remove"):
                case.set(path, None)
        with self.assertRaisesRegex(KeyError, "not an entry of a list"):
            case.set("materials.sand", None)
        case["stages"] = [{"name": "first", "analysis": {}}]
        self.assertEqual(case.set("stages.first.analysis.damping", None)["stages"][0]["analysis"], {"damping": None})

    def test_mistakes_in_a_dictionary_have_paths_instead_of_lines(self):
        case = column()
        case.name = "column.json"
        case["materials"][0]["density"] = -1
        case["materials"].append({**case["materials"][0], "density": 1})
        with self.assertRaises(lahar.InvalidInput) as raised:
            case.check()
        self.assertNotRegex(str(raised.exception), r"column.json:\d|on line")
        self.assertIn("column.json: error: 'density' must be", str(raised.exception))
        self.assertIn("[/materials/0/density]\n        \"density\": -1", str(raised.exception))

    def test_numbers_of_numpy_are_numbers_and_nan_is_refused(self):
        case = column()
        case["external_loading_conditions"]["gravity"] = numpy.array([0, -9.81])
        case["materials"][0]["friction"] = numpy.float64(22)
        self.assertEqual(json.loads(case.to_json()), json.loads(column().to_json()))
        case["materials"][0]["friction"] = float("nan")
        with self.assertRaises(lahar.InvalidInput):
            case.check()

    def test_each_stage_is_checked(self):
        case = column()
        case["stages"] = [{"name": "first", "analysis": {"end_time": 0.01}}, {"name": "second"}]
        self.assertEqual([check.stage for check in case.check()], ["first", "second"])

    def test_the_schema_has_the_keys(self):
        self.assertIn("analysis", lahar.schema()["$defs"]["Scenario"]["properties"])
        self.assertIn("end_time", lahar.reference())


if __name__ == "__main__":
    unittest.main()
