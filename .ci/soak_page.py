#!/usr/bin/env python3
"""The page docs/soak.md, from the results of `make soak` (a JSON object a line, see test/base/Tier.scala)."""
import argparse
import json
import pathlib
import re

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--sources", help="the commit of the results that are added")
parser.add_argument("--add", type=pathlib.Path, help="results that are taken into the record first")
parser.add_argument("record", type=pathlib.Path, help="docs/soak.json")
options = parser.parse_args()


def number(value):
    return f"{value:,.0f}"


def duration(seconds):
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{seconds:.1f} s"


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |")


tests = "".join(p.read_text() for p in pathlib.Path("test").rglob("*.scala"))
results = json.loads(options.record.read_text()) if options.record.exists() else []
if options.add:
    new = [json.loads(line) for line in options.add.read_text().splitlines()]
    new = [dict(r, sources=options.sources) for r in new]
    # A check that has run again has the parts of that run.
    again = {r["check"] for r in new}
    results = [r for r in results if r["check"] not in again]
    # Of a part that has run twice the last result counts.
    results += {(r["check"], r["part"]): r for r in new}.values()
    # One that there is no more is forgotten.
    results = sorted((r for r in results if r["check"] in tests), key=lambda r: r["check"])
    options.record.write_text(json.dumps(results, indent=1) + "\n")

checks = {}
for result in results:
    checks.setdefault(result["check"], []).append(result)

print("# Soak")
print()
print("Written by `make soak`, which does in full what `make test` does in samples. Do not edit. The same as")
print("data: [soak.json](soak.json). Parts ran at the same time; each check names the sources it ran on.")
print()
print("## What is a sample in `make test`")
print()
row("Check", "Counted in", "`make soak`", "Sources")
row("---", "---", "---:", "---")
for check, parts in checks.items():
    row(check, parts[0]["unit"], number(parts[0]["soak"]), parts[0]["sources"])
print()
missing = sorted(set(re.findall(r'\bTier\(\s*"([^"]+)"', tests)) - set(checks), key=str.lower)
if missing:
    print("Of these no full run is on record:")
    print()
    for check in missing:
        print(f"- {check[0].upper()}{check[1:]}")
    print()
print("## Results")
for check, parts in checks.items():
    print()
    print(f"### {check[0].upper()}{check[1:]}")
    print()
    row("Part", parts[0]["unit"][0].upper() + parts[0]["unit"][1:], "Seed", "Duration", "Result")
    row("---", "---:", "---:", "---:", "---")
    for part in parts:
        seed = part["seed"] if part["seed"] is not None else ""
        verdict = "passed" if part["passed"] else "FAILED"
        row(part["part"], number(part["size"]), seed, duration(part["seconds"]), verdict)
