#!/usr/bin/env python3
"""Whether the manual page has the commands and options that the program has, and no others.

    man_page_test.py PROGRAM PAGE

PROGRAM is asked with --help; PAGE is the source of the page, in the macros of man(7). On the page

- SYNOPSIS has, for each command, each of its options;
- COMMANDS has an entry for each command, and for each word such as `locate` in `lahar bench locate`;
- each option is described: as the tag of an entry of OPTIONS, or in the entry of its command;
- options that the page mentions exist, for that command where the page says which.
"""
import re
import subprocess
import sys
from pathlib import Path

OPTION = re.compile(r"(?<![\w-])--?[A-Za-z][\w-]*")
PROGRAM = "lahar"


class Command:
    """A command of the program: its name ("" is the program itself) and what its --help lists."""

    def __init__(self, program, words=()):
        self.name = " ".join(words)
        self.full = " ".join((PROGRAM, *words))
        self.options = []  # names of each: ["-t", "--threads"]
        self.choices = []  # words that its arguments can be: ["ranks", "overlap"]
        self.below = []
        part = ""
        for line in help_of(program, words).splitlines():
            if re.fullmatch(r"[A-Za-z]+:", line):
                part = line[:-1].capitalize()
            elif not line.startswith("  ") or line.startswith("   "):
                continue  # a paragraph, or the rest of an entry
            elif part == "Options":
                self.options.append(re.split(r",\s*", re.match(r"  (-\S+(?:,\s+-\S+)*)", line).group(1)))
            elif part == "Positionals":
                for listed in re.findall(r":\{([^}]*)\}", line):
                    self.choices += listed.split(",")
            elif part == "Subcommands":
                self.below.append(Command(program, (*words, line.split()[0])))

    def names(self):
        return {name for option in self.options for name in option}

    def all(self):
        return [self, *(other for command in self.below for other in command.all())]


def help_of(program, words):
    command = [program, *words, "--help"]
    result = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    if result.returncode != 0:
        sys.exit(f"`{' '.join(command)}` ended with {result.returncode}: {result.stderr.strip()}")
    return result.stdout


class Line:
    """A line of the page: its macro ("" for text) and its words as a reader sees them."""

    def __init__(self, number, source):
        self.number = number
        found = re.match(r"\.(\w+) ?(.*)", source)
        self.macro, text = found.groups() if found else ("", source)
        if self.macro:
            words = [quoted or bare for quoted, bare in re.findall(r'"([^"]*)"|(\S+)', text)]
            # Macros of two fonts set their arguments without blanks between them.
            text = ("" if len(self.macro) == 2 and self.macro not in ("SH", "SS", "TP") else " ").join(words)
        self.text = re.sub(r"\\f(?:\[\w*\]|.)", "", text).replace("\\-", "-")


class Entry:
    """Lines that belong together: of one command in SYNOPSIS, or from one .TP to the next."""

    def __init__(self, lines, tagged):
        self.number = lines[0].number
        self.tag = lines[0].text if tagged else ""
        self.lines = lines

    def text(self):
        return " ".join(line.text for line in self.lines)

    def options(self):
        """(line, option, what stands before it on the line)"""
        for line in self.lines:
            for found in OPTION.finditer(line.text):
                yield line.number, found.group(), line.text[:found.start()]


class Page:
    def __init__(self, path):
        self.name = path.name
        self.sections = {}
        title = ""
        for number, source in enumerate(path.read_text().splitlines(), 1):
            if source.startswith('.\\"'):
                continue
            line = Line(number, source)
            if line.macro == "SH":
                title = line.text
            self.sections.setdefault(title, []).append(line)
        for needed in ("SYNOPSIS", "COMMANDS", "OPTIONS"):
            if needed not in self.sections:
                sys.exit(f"{self.name}: section {needed} is missing. Add it with `.SH {needed}`.")

    def entries(self, title, begins):
        """Entries of a section; begins(line before, line) tells the first lines of them."""
        lines, entries = self.sections[title], []
        for before, line in zip(lines, lines[1:]):
            if begins(before, line):
                entries.append([])
            if entries and line.macro not in ("TP", "br", "PP"):
                entries[-1].append(line)
        return [Entry(entry, title != "SYNOPSIS") for entry in entries]

    def synopsis(self):
        return self.entries("SYNOPSIS", lambda _, line: line.text.startswith(PROGRAM + " "))

    def tagged(self, title):
        return self.entries(title, lambda before, _: before.macro == "TP")

    def rest(self):
        """Everything but SYNOPSIS, COMMANDS and the title."""
        for title, lines in self.sections.items():
            if title not in ("", "SYNOPSIS", "COMMANDS"):
                yield Entry(lines, False)


def command_of(text, commands):
    """The command that a text begins with, by its longest name: "bench locate" before "bench"."""
    named = [c for c in commands if c.name and re.match(re.escape(c.name) + r"(?![\w-])", text)]
    return max(named, key=lambda command: len(command.name), default=None)


def problems_of(page, program):
    commands = program.all()
    known = {name for command in commands for name in command.names()}
    help_names = {"-h", "--help"}
    problems = []

    def say(line, text):
        problems.append(f"{page.name}:{line}: {text}")

    def check_known(entry, owner):
        for line, option, before in entry.options():
            named = re.findall(rf"(?<![\w-]){PROGRAM} (\w+(?: [\w.-]+)*)", before)
            command = (command_of(named[-1], commands) if named else None) or owner
            if option not in (command.names() if command else known):
                whose = f"`{command.full}`" if command else "any command"
                say(line, f"{option} is not an option of {whose}. Remove it, or correct its name.")

    # SYNOPSIS: each command, with all that it takes.
    start = page.sections["SYNOPSIS"][0].number
    seen = {}
    for entry in page.synopsis():
        text = entry.text()[len(PROGRAM):].strip()
        command = command_of(text, commands) or (program if text.startswith(("-", "[-")) else None)
        if command is None:
            say(entry.number, f"SYNOPSIS has `{PROGRAM} {text.split()[0]}`, which is not a command. "
                "Remove it, or correct its name.")
            continue
        seen[command] = entry
        check_known(entry, command)
        shown = {option for _, option, _ in entry.options()}
        for names in command.options:
            if not shown & set(names) and not help_names & set(names):
                say(entry.number, f"SYNOPSIS of `{command.full}` lacks {names[-1]}. Add it there.")
    for command in commands:
        if command not in seen and not command.below:
            say(start, f"SYNOPSIS lacks `{command.full}`. Add it, with its options.")

    # COMMANDS: an entry for each.
    start = page.sections["COMMANDS"][0].number
    described = {command: set() for command in commands}
    words = {f"{command.name} {choice}".strip(): False for command in commands for choice in command.choices}
    for entry in page.tagged("COMMANDS"):
        command = None
        for name in entry.tag.split(", "):
            command = command_of(name, commands)
            if command is None:
                say(entry.number, f"COMMANDS has an entry '{name}', which is not a command. "
                    "Remove it, or correct its name.")
                continue
            if name in words:
                words[name] = True
            elif command.choices and re.match(r"[a-z]", name[len(command.name):].strip()):
                say(entry.number, f"COMMANDS has an entry '{name}', but `{command.full}` takes only "
                    f"{', '.join(command.choices)}. Remove it, or correct its name.")
            else:
                seen[command] = seen.get(command) or entry
                words[command.name] = True
        if command:
            check_known(entry, command)
            described[command] |= {option for _, option, before in entry.options()
                                   if f"{PROGRAM} " not in before}
    for name in [command.name for command in commands if command.name] + list(words):
        if not words.get(name, False):
            say(start, f"COMMANDS lacks an entry '{name}', which the program has. Add it.")
            words[name] = True  # once

    # OPTIONS: what no entry of COMMANDS describes.
    start = page.sections["OPTIONS"][0].number
    tags = set()
    for entry in page.tagged("OPTIONS"):
        tags |= set(OPTION.findall(entry.tag))
    lacking = {}
    for command in commands:
        for names in command.options:
            for name in names:
                if name not in tags and name not in described[command]:
                    lacking.setdefault(name, []).append(f"`{command.full}`")
    for name, owners in lacking.items():
        say(start, f"{name} of {', '.join(owners)} is not described. Add an entry to OPTIONS, or "
            "describe it in COMMANDS.")

    for entry in page.rest():
        check_known(entry, None)
    return problems


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, page = Command(sys.argv[1]), Page(Path(sys.argv[2]))
    commands = program.all()
    if len(commands) < 2 or not all(command.options for command in commands):
        sys.exit(f"`{sys.argv[1]} --help` lists no commands or options that this test can read. "
                 "If its layout has changed, adapt class Command.")
    problems = problems_of(page, program)
    for problem in problems:
        print(problem)
    if not problems:
        print(f"{len(commands) - 1} commands, {sum(len(command.options) for command in commands)} options: "
              f"all are in {page.name}")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
