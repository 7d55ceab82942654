#!/usr/bin/env python3
"""Whether shells complete what the program has.

    completion_test.py PROGRAM

The script for bash is sourced and asked. Those for zsh and fish are read by these shells where they
are installed, and have all commands and options anyway.
"""
import re
import shutil
import subprocess
import sys

PROGRAM = sys.argv[1]


def said(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=True).stdout


def commands():
    text = said("--help").split("Subcommands:")[1].split("\n\n")[0]
    return [line.split()[0] for line in text.splitlines() if line.startswith("  ")]


def options(command):
    """What --help lists at the beginning of a line."""
    found = set()
    for line in said(command, "--help").splitlines():
        if names := re.match(r"  ((?:-\w,)?--[\w-]+)", line):
            found.update(names[1].split(","))
    return found


def complete(*words):
    """What bash would complete the last of the words to."""
    quoted = " ".join(f"'{word}'" for word in words)
    script = said("info", "--completion", "bash") + f"""
COMP_WORDS=({quoted}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _lahar
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    out = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True).stdout
    return set(out.split())


def main():
    known = commands()
    assert len(known) > 8, known
    assert complete("lahar", "") == {*known, "--help", "--version"}
    assert complete("lahar", "exp") == {"export"}
    zsh, fish = said("info", "--completion", "zsh"), said("info", "--completion", "fish")
    for command in known:
        wanted = options(command)
        assert wanted and complete("lahar", command, "-") == wanted, (command, wanted)
        assert complete("lahar", command, "") == set(), "files are for the shell"
        line = re.search(rf"^ *{command}\) options=\((.*)\) ;;$", zsh, re.MULTILINE)
        assert set(line[1].split()) == wanted, command
        lines = [l for l in fish.splitlines() if f"seen_subcommand_from {command}'" in l]
        assert len(lines) >= len(wanted) / 2 and f"-a {command} -d" in fish, command
    for shell, script in (("zsh", zsh), ("fish", fish)):
        if shutil.which(shell):
            subprocess.run([shell, "-n"], input=script, text=True, check=True)


if __name__ == "__main__":
    main()
