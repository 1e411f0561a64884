#!/usr/bin/env python3
"""What sbt's tests have done, from the JUnit reports in target/: how many passed, failed, were skipped; with
--slowest N the N suites that took longest, with their seconds. Prints "PASSED FAILED SKIPPED" as its last line."""
import argparse
import pathlib
import xml.etree.ElementTree as ElementTree

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--slowest", type=int, default=0, metavar="N")
parser.add_argument("--target", type=pathlib.Path, default=pathlib.Path("target"))
options = parser.parse_args()

suites = []
for report in sorted(options.target.glob("*/test-reports/TEST-*.xml")):
    # A suite's element may hold elements of the suites in it; only the outermost counts.
    suites.append(ElementTree.parse(report).getroot())


def count(name):
    return sum(int(suite.get(name, 0)) for suite in suites)


failed = count("failures") + count("errors")
# A canceled test (its tool or recording is missing) is "skipped".
skipped = count("skipped")
if options.slowest and suites:
    print(f"The {options.slowest} slowest of {len(suites)} suites, in seconds:")
    for suite in sorted(suites, key=lambda s: -float(s.get("time", 0)))[: options.slowest]:
        print(f"{float(suite.get('time', 0)):8.1f}  {suite.get('name')}")
print(count("tests") - failed - skipped, failed, skipped)
