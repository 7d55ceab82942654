"""Mounts that only a test sees."""

import os
import shutil
import subprocess
import sys

MARK = "LAHAR_TEST_NAMESPACE"


def enter(setup="true"):
    """Starts this program again in a mount namespace of its own, in which the shell command `setup` was run.

    Returns whether it is in one, which not every system allows.
    """
    if MARK in os.environ:
        return True
    for options in (["-m"], ["-rm"]):
        command = ["unshare", *options, "sh", "-c", f'{setup} && exec "$@"', "sh"]
        probe = [*command, "sh", "-c", "mount -t tmpfs none /mnt"]
        if shutil.which("unshare") and subprocess.run(probe, capture_output=True).returncode == 0:
            os.environ[MARK] = "1"
            os.execvp(command[0], [*command, sys.executable, *sys.argv])
    return False
