#!/usr/bin/env python3
"""The test suites that a change may concern, one name a line, then make targets as "make TARGET".

A Scala file concerns those that can see its package and name a class, object or trait it defines, and so on
from file to file, in src and test: rather too many than too few. Other files concern what the table below
says."""
import argparse
import pathlib
import re
import subprocess
import sys

# The first pattern that matches a path decides: folders of suites, then make targets; "*" is every suite.
OTHERS = [
    (r"(build\.sbt|project/.*)$", ["*"], []),
    (r"src/sim/objcache$", ["*"], ["cosim-selftest", "firmware-test"]),
    (r"src/firmware/(driver|slave)/|test/firmware/stack/", ["firmware", "e2e"], ["firmware-test"]),
    (r"src/firmware/ring/|test/firmware/ring/", ["transport", "ring"], []),
    (r"src/firmware/node/|test/firmware/node/", ["node", "ring"], []),
    (r"src/firmware/|test/firmware/", ["e2e"], ["firmware-test"]),
    (r"src/sim/|test/sim/", ["cosim", "replay", "e2e", "ring"], ["cosim-selftest", "firmware-test"]),
    (r"src/server/resources/", ["server", "e2e"], []),
    (r"fpga/|test/flyframe/board/", ["board", "device", "report"], []),
    (r"generated/", ["board", "device", "flyframe"], ["check-generated", "lint", "firmware-test"]),
    (r"test/(base|rtl|server|flyframe)/.*resources/", ["*"], []),
    (r"src/campaign/|test/campaign/", [], ["campaign-test"]),
    (r"docs/rules/", ["rules", "registers"], []),
    (r"src/base/resources/", ["device"], []),
    (r"docs/report\.json$", ["report"], []),
]
# What the sources of a floor may use, see build.sbt.
FLOORS = {
    "base": {"base"},
    "rtl": {"base", "rtl"},
    "flyframe": {"base", "rtl", "flyframe"},
    "server": {"base", "rtl", "flyframe", "server"},  # its tests; its sources less
}
# These read all sources and pages, in a second: any change concerns them.
READERS = [
    "flyframe.ImportsSpec",
    "flyframe.ProseSpec",
    "flyframe.report.BlocksSpec",
    "flyframe.rules.CoverageSpec",
]
DEFINED = re.compile(
    r"^(?:(?:final|sealed|abstract|case|implicit|private|private\[\w+\]) )*"
    r"(?:class|object|trait|type) (\w+)",
    re.M,
)
SUITE = re.compile(r"^class (\w+(?:Spec|Formal))\b", re.M)
PACKAGE = re.compile(r"^package ([\w.]+)", re.M)


def changed(since):
    """Paths that differ from a commit, and new files that git does not ignore."""
    lists = [["git", "diff", "--name-only", since], ["git", "ls-files", "--others", "--exclude-standard"]]
    outputs = [subprocess.run(c, capture_output=True, text=True, check=True).stdout for c in lists]
    return {path for output in outputs for path in output.split("\n") if path}


class Source:
    """A Scala file: its package, what it defines, and the words of it that are neither comment nor string."""

    def __init__(self, path):
        text = path.read_text()
        self.floor = path.parts[1]
        self.package = PACKAGE.search(text).group(1)
        self.defines = set(DEFINED.findall(text))
        self.suites = SUITE.findall(text)
        self.code = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.S)
        self.words = set(re.findall(r"\w+", self.code))

    def uses(self, other):
        """Whether it may use what the other file defines."""
        names = self.words & other.defines
        if not names or other.floor not in FLOORS[self.floor]:
            return False
        if self.package == other.package:
            return True
        if "." in other.package:  # imported, or with the last name of the package before it
            return f"{other.package.split('.')[-1]}." in self.code
        # Of the package that all others are in: imported by name.
        imported = re.findall(rf"\b{other.package}\.(\w+|\{{[^}}]*\}})", self.code)
        return any(names & set(re.findall(r"\w+", i)) for i in imported)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("since", help="commit to compare with")
    since = parser.parse_args().since
    known = ["git", "rev-parse", "-q", "--verify", f"{since}^{{commit}}"]
    if subprocess.run(known, capture_output=True).returncode:
        print(f"SINCE is {since} but must be a commit of this repository.", file=sys.stderr)
        return 2
    paths = changed(since)

    sources = {str(f): Source(f) for top in ("src", "test") for f in pathlib.Path(top).rglob("*.scala")}
    # A file that is gone is none of them: whoever used it is changed too, or does not compile.
    concerned = new = {p for p in paths if p in sources}
    while new:
        new = {f for f in sources if f not in concerned and any(sources[f].uses(sources[n]) for n in new)}
        concerned = concerned | new

    folders, targets = set(), set()
    for path in paths - set(sources):
        for pattern, suites, makes in OTHERS:
            if re.match(pattern, path):
                folders.update(suites)
                targets.update(makes)
                break
    suites = set(READERS) if paths else set()
    for f, source in sources.items():
        if f.startswith("test/") and (f in concerned or "*" in folders or set(f.split("/")) & folders):
            suites.update(f"{source.package}.{suite}" for suite in source.suites)
    for suite in sorted(suites):
        print(suite)
    for target in sorted(targets):
        print(f"make {target}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
