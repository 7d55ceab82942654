#!/usr/bin/env python3
"""Whether every #include goes to the own room or to one below it, and rooms below have no cycle.

    rooms_test.py SOURCE_FOLDER

Rooms and what lies below them are the lines lahar_room(...) of CMakeLists.txt. Tests mirror them: a file of
tests/<room>/ may include what its folder may, and what is beside it.

Besides: names of test cases are such that CTest finds them.
"""
import re
import sys
from pathlib import Path

FOLDERS = ("physics", "graph", "io", "runtime")


def rooms_of(text):
    """{room: rooms directly below}, from CMakeLists.txt."""
    rooms = {}
    for line in re.findall(r"^lahar_room\(([^)]*)\)", text, re.M):
        words = line.split()
        uses = []
        if "USES" in words:
            for word in words[words.index("USES") + 1:]:
                if word.isupper():
                    break
                uses.append(word)
        rooms[words[0]] = uses
    return rooms


def all_below(rooms, room, way=()):
    if room in way:
        sys.exit(f"CMakeLists.txt: rooms in a circle: {' -> '.join((*way, room))}")
    below = set()
    for other in rooms[room]:
        if other not in rooms:
            sys.exit(f"CMakeLists.txt: {room} uses {other}, but no lahar_room() line declares it")
        below |= {other} | all_below(rooms, other, (*way, room))
    return below


def includes(file):
    for number, line in enumerate(file.read_text().splitlines(), 1):
        found = re.match(r'#include "((?:%s)/[^"]+)"' % "|".join(FOLDERS), line)
        if found:
            yield number, found.group(1)


def cycles(graph):
    """Headers that include themselves by way of others."""
    found, done = [], set()

    def visit(node, way):
        if node in way:
            found.append(" -> ".join([*way[way.index(node):], node]))
            return
        if node in done:
            return
        for other in graph.get(node, ()):
            visit(other, [*way, node])
        done.add(node)

    for node in graph:
        visit(node, [])
    return found


def main():
    root = Path(sys.argv[1])
    rooms = rooms_of((root / "CMakeLists.txt").read_text())
    below = {room: all_below(rooms, room) for room in rooms}
    problems, graph = [], {}
    for top in FOLDERS:
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".h", ".cpp"):
                continue
            name, room = str(file.relative_to(root)), str(file.parent.relative_to(root))
            if room not in rooms:
                problems.append(f"{name}: CMakeLists.txt has no room {room}. Add it there, or move the file")
                continue
            for line, target in includes(file):
                graph.setdefault(name, []).append(target)
                other = str(Path(target).parent)
                if not (root / target).is_file():
                    problems.append(f"{name}:{line}: there is no {target}")
                elif other != room and other not in below[room]:
                    problems.append(f"{name}:{line}: {target} is not below {room}")
    for test in sorted((root / "tests").rglob("*")):
        room = str(test.parent.relative_to(root / "tests"))
        if room not in rooms or test.suffix not in (".h", ".cpp"):
            continue
        top = room.split("/")[0]
        for line, target in includes(test):
            if FOLDERS.index(target.split("/")[0]) > FOLDERS.index(top):
                problems.append(f"tests/{room}/{test.name}:{line}: {target} is above {top}")
    for test in sorted((root / "tests").rglob("*.cpp")):
        for name in re.findall(r'TEST_CASE(?:_TEMPLATE)?\(\s*"([^"]*)"', test.read_text()):
            if re.search(r"[;\[\]\\]", name):
                problems.append(f"{test.relative_to(root)}: CTest cannot find '{name}': no ; [ ] or \\ in names")
    problems += [f"headers in a circle: {circle}" for circle in cycles(graph)]
    for problem in problems:
        print(problem)
    if not problems:
        print(f"{len(rooms)} rooms, {sum(map(len, graph.values()))} includes: all go down")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
