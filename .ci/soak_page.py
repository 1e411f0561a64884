#!/usr/bin/env python3
"""The page docs/soak.md, from the results of `make soak` (a JSON object a line, see test/base/Tier.scala)."""
import argparse
import json
import os
import pathlib
import subprocess
import sys

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--seconds", type=int, required=True, help="what the whole run took")
parser.add_argument("results", type=pathlib.Path)
options = parser.parse_args()


def number(value):
    return f"{value:,.0f}"


def duration(seconds):
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{seconds:.1f} s"


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |")


results = [json.loads(line) for line in options.results.read_text().splitlines()]
if not results:
    sys.exit(f"{options.results} is empty: no soak has run.")
checks = {}
# Of a part that has run again the last result counts.
for result in {(r["check"], r["part"]): r for r in results}.values():
    checks.setdefault(result["check"], []).append(result)
describe = ["git", "describe", "--always", "--dirty"]
commit = subprocess.run(describe, capture_output=True, text=True, check=True)

print("# Soak")
print()
print("Written by `make soak`, which does in full what `make test` does in samples. Do not edit.")
print()
print(f"Sources: {commit.stdout.strip()}. All runs together took {duration(options.seconds)}")
print(f"on {os.cpu_count()} cores, on which several parts ran at the same time.")
print()
print("## What is a sample in `make test`")
print()
row("Check", "Counted in", "`make test`", "`make soak`")
row("---", "---", "---:", "---:")
for check, parts in sorted(checks.items()):
    row(check, parts[0]["unit"], number(parts[0]["test"]), number(parts[0]["soak"]))
print()
print("## Results")
for check, parts in sorted(checks.items()):
    print()
    print(f"### {check[0].upper()}{check[1:]}")
    print()
    row("Part", parts[0]["unit"][0].upper() + parts[0]["unit"][1:], "Seed", "Duration", "Result")
    row("---", "---:", "---:", "---:", "---")
    for part in parts:
        seed = part["seed"] if part["seed"] is not None else ""
        verdict = "passed" if part["passed"] else "FAILED"
        row(part["part"], number(part["size"]), seed, duration(part["seconds"]), verdict)
