"""Types of the package, by mypy where it is installed."""
import subprocess
import sys
import unittest

from case import SOURCE


class TypesTest(unittest.TestCase):
    def test_the_package_is_typed(self):
        if subprocess.run([sys.executable, "-m", "mypy", "--version"], capture_output=True).returncode != 0:
            self.skipTest("mypy is not installed (Debian: mypy)")
        checked = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir=/dev/null"], cwd=SOURCE, text=True,
                                 capture_output=True)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)


if __name__ == "__main__":
    unittest.main()
