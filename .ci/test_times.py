#!/usr/bin/env python3
"""What a run of sbt's tests has done: how many passed, failed, were canceled (their tool or recording is
missing), by the summaries that each floor has printed into the log. By the JUnit reports in target/: with
--slowest N the N suites that took longest, with their seconds; and each test that failed, with what it said,
so that the end of a run tells it. Prints "PASSED FAILED CANCELED" as its last line."""
import argparse
import pathlib
import re
import xml.etree.ElementTree as ElementTree

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("log", type=pathlib.Path)
parser.add_argument("--slowest", type=int, default=0, metavar="N")
parser.add_argument("--target", type=pathlib.Path, default=pathlib.Path("target"))
options = parser.parse_args()

log = re.sub(r"\x1b\[[0-9;]*m", "", options.log.read_text(errors="replace"))
tests = re.findall(r"Tests: succeeded (\d+), failed (\d+), canceled (\d+)", log)
# The reports do not tell canceled tests from passed ones, and say nothing of a suite that could not be run.
aborted = sum(int(n) for n in re.findall(r"Suites: completed \d+, aborted (\d+)", log))
passed, failed, canceled = (sum(int(row[i]) for row in tests) for i in range(3))

suites = []
for report in options.target.glob("*/test-reports/TEST-*.xml"):
    try:
        suites.append(ElementTree.parse(report).getroot())
    except ElementTree.ParseError:
        pass  # of a suite that was cut off

if options.slowest:
    print(f"The {options.slowest} slowest of {len(suites)} suites, in seconds:")
    for suite in sorted(suites, key=lambda s: -float(s.get("time", 0)))[: options.slowest]:
        print(f"{float(suite.get('time', 0)):8.1f}  {suite.get('name')}")
for suite in suites:
    for test in suite.iter("testcase"):
        for what in [*test.iter("failure"), *test.iter("error")]:
            print(f"FAILED: {suite.get('name')}: {test.get('name')}: {(what.get('message') or '')[:400]}")
print(passed, failed + aborted, canceled)
