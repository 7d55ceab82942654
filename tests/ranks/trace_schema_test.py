"""What `lahar trace` writes for programs is as its schemas say.

    trace_schema_test.py CHECKED.json SCHEMA.json [CHECKED.json SCHEMA.json ...]

Files that end with .gz are compressed. Exit status 77: there is no validator.
"""

import copy
import gzip
import json
import sys

try:
    from jsonschema import Draft202012Validator
except ImportError:
    print("SKIPPED: there is no validator of JSON Schema (apt-get install python3-jsonschema)")
    sys.exit(77)


def read(path):
    with (gzip.open if path.endswith(".gz") else open)(path, "rt") as file:
        return json.load(file)


def problems(validator, value):
    return ["/".join(map(str, error.absolute_path)) + ": " + error.message[:200]
            for error, _ in zip(validator.iter_errors(value), range(5))]


def damaged(value):
    """Copies with something wrong in them, that a schema which is worth something refuses."""
    for key in value:
        without = dict(value)
        del without[key]
        yield f"no {key}", without
    yield "a key that nobody knows", {**value, "unknown": 1}
    events = value.get("traceEvents", [])
    for kind in sorted({event["ph"] for event in events}):
        event = next(event for event in events if event["ph"] == kind)
        for key in event:
            without = dict(event)
            del without[key]
            yield f"an event {kind} without {key}", {**value, "traceEvents": [without]}
        if "dur" in event:
            yield "a negative duration", {**value, "traceEvents": [{**event, "dur": -1}]}
    if "stages" in value:
        wrong = copy.deepcopy(value)
        wrong["stages"][0]["mean"] = -1
        yield "a negative time", wrong
        wrong = copy.deepcopy(value)
        wrong["findings"][0]["name"] = "bad luck"
        yield "a loss that nobody knows", wrong


failed = False
for path, schema_path in zip(sys.argv[1::2], sys.argv[2::2]):
    schema, value = read(schema_path), read(path)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    for problem in problems(validator, value):
        print(f"{path} is not as {schema_path} says: {problem}")
        failed = True
    for what, wrong in damaged(value):
        if validator.is_valid(wrong):
            print(f"{schema_path} accepts {what}")
            failed = True
sys.exit(1 if failed else 0)
