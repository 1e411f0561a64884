#!/usr/bin/env python3
"""Applies deliberate defects one at a time, and runs the suite of `make test` that is expected to find each.

A defect is a patch NN-name.patch beside this file. Its first lines are a comment:

    # What is wrong.
    # Expected to be found by: SUITE

SUITE is `sbt PROJECT CLASS [options of the test runner]` or `make TARGET`. All work is done on the newest
commit, in a checkout of its own (build/mutants/checkout) and in one sbt process; the checkout one works in is
never touched. First each suite must pass without a defect, or its finds would mean nothing. Results are in
build/mutants/results.json: what has been tried on this commit is not tried again. Exit code 1 if more defects
survive than are allowed, or if one does not apply, does not compile, or has a suite that fails by itself.
"""
import argparse
import fcntl
import hashlib
import json
import os
import pathlib
import queue
import re
import shlex
import signal
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "build/mutants"
CHECKOUT = WORK / "checkout"
RESULTS = WORK / "results.json"
LIMIT_S = 1800  # for one suite

FOUND, SURVIVED, NOT_APPLIED, NOT_COMPILED, NO_BASE = (
    "found", "survived", "does not apply", "does not compile", "suite fails without it")


class Trouble(Exception):
    """The run cannot go on; the message is one sentence."""


class Mutant:
    def __init__(self, path):
        self.path = path
        self.name = path.stem
        self.number = path.stem.split("-")[0]
        self.text = path.read_text()
        head = re.match(r"# (.+)\n# Expected to be found by: ((?:sbt|make) .+)\n---", self.text)
        if not head:
            raise Trouble(f"{path.name} does not begin with what is wrong and what should find it.")
        self.defect, self.suite = head.groups()

    def key(self):
        return self.name + " " + hashlib.sha256(self.text.encode()).hexdigest()[:16]

    def apply(self, *flags):
        """True if the patch applies; a line of context is enough, so that neighbours may change."""
        return git("apply", "-C1", *flags, str(self.path), cwd=CHECKOUT, check=False).returncode == 0


def git(*arguments, cwd=ROOT, check=True):
    return subprocess.run(["git", *arguments], cwd=cwd, check=check, text=True, capture_output=True)


def prepare():
    """The checkout at the newest commit, without changes; what has been built there stays."""
    commit = git("rev-parse", "HEAD").stdout.strip()
    git("worktree", "prune")
    if not CHECKOUT.exists():
        git("worktree", "add", "--detach", str(CHECKOUT), commit)
    git("checkout", "--detach", "--force", commit, cwd=CHECKOUT)
    # Tools and recordings are where the tests look for them.
    (CHECKOUT / "build").mkdir(exist_ok=True)
    links = (CHECKOUT / "build/tools", ROOT / "build/tools"), (WORK / "shared", ROOT.parent / "shared")
    for link, target in links:
        if not link.is_symlink():
            link.symlink_to(target)
    return commit


class Sbt:
    """One sbt process for all suites. Commands go to its standard input; each ends with the time it took."""

    ENDS = re.compile(r"\[(success|error)\] Total time:")

    def __init__(self, command, log):
        self.command, self.log = command, log
        self.process = self.lines = None

    def start(self):
        environment = dict(os.environ, PATH=f"{ROOT}/build/tools/bin:{os.environ['PATH']}")
        self.process = subprocess.Popen(
            shlex.split(self.command), cwd=CHECKOUT, env=environment, text=True, errors="replace", bufsize=1,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
        self.lines = queue.Queue()
        threading.Thread(target=self.read, args=(self.process.stdout, self.lines), daemon=True).start()

    @staticmethod
    def read(output, lines):
        for line in output:
            lines.put(line)
        lines.put(None)

    def run(self, command):
        """Runs one task; whether it succeeded, and its output."""
        if self.process is None or self.process.poll() is not None:
            self.start()
        self.log.write(f"sbt> {command}\n")
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        end, output = time.monotonic() + LIMIT_S, []
        while True:
            try:
                line = self.lines.get(timeout=max(0.1, end - time.monotonic()))
            except queue.Empty:
                self.stop()
                return False, "".join(output) + f"\nno end within {LIMIT_S} s\n"
            if line is None:
                raise Trouble(f"sbt has ended; the end of its output is in {self.log.name}.")
            self.log.write(line)
            self.log.flush()
            output.append(re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", line))
            ended = self.ENDS.search(output[-1])
            if ended:
                return ended[1] == "success", "".join(output)

    def stop(self):
        if self.process and self.process.poll() is None:
            os.killpg(self.process.pid, 15)  # with the programs of the tests; its own session
            self.process.wait()
        self.process = None


def run_suite(suite, sbt):
    """passed, failed or does not compile."""
    kind, rest = suite.split(" ", 1)
    if kind == "make":
        try:
            done = subprocess.run(["make", "-s", rest], cwd=CHECKOUT, text=True, errors="replace",
                                  timeout=LIMIT_S, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        except subprocess.TimeoutExpired:
            return "failed"
        sbt.log.write(done.stdout)
        if done.returncode == 0:
            return "passed"
        # A compiler's error names file, line and "error:"; a failed test does not.
        compiled = not re.search(r":\d+:\d+: (fatal )?error:|error: ld returned", done.stdout)
        return "failed" if compiled else NOT_COMPILED
    project, suite_class, *options = shlex.split(rest)
    if not sbt.run(f"{project}/Test/compile")[0]:
        return NOT_COMPILED
    arguments = " ".join(f'"{o}"' if " " in o or "[" in o else o for o in options)
    succeeded, output = sbt.run(f"{project}/testOnly {suite_class}" + (f" -- {arguments}" if options else ""))
    counts = re.search(r"Tests: succeeded (\d+), failed (\d+)", output)
    if succeeded:
        if not counts or int(counts[1]) == 0:
            raise Trouble(f"The suite '{suite}' has no test.")
        return "passed"
    # Only a test that has failed is a find: not a suite that could not be run, nor what Chisel or a compiler
    # refuses; an assertion in the hardware is one, though Verilator tells of it as an error.
    refused = (
        r"(chisel3|firrtl|circt)\S*Exception|IllegalArgumentException|OutOfMemoryError|"
        r"%Error(?!.*Assertion failed)|: error: "
    )
    if not counts or int(counts[2]) == 0 or re.search(refused, output):
        return NOT_COMPILED
    return "failed"


def show(rows):
    width = max((len(m.name) for m, _, _ in rows), default=0)
    for m, result, seconds in rows:
        print(f"{m.name:{width}}  {result:22}  {seconds:5.0f} s  {m.suite}")
    kinds = (FOUND, SURVIVED, NOT_APPLIED, NOT_COMPILED, NO_BASE)
    counts = {kind: sum(row[1] == kind for row in rows) for kind in kinds}
    print(", ".join(f"{count} {name}" for name, count in counts.items() if count or name == FOUND))
    return counts


def main():
    parser = argparse.ArgumentParser(description="Tries whether the tests find deliberate defects.")
    parser.add_argument("mutants", nargs="*", help="numbers or names of mutants (default: all)")
    parser.add_argument("--allowed", type=int, default=0, metavar="N", help="may survive (default: 0)")
    parser.add_argument("--check", action="store_true", help="only try whether all apply")
    parser.add_argument("--again", action="store_true", help="forget the results of this commit")
    parser.add_argument("--sbt", default="sbt", help="command that starts sbt (default: sbt)")
    options = parser.parse_args()
    mutants = [Mutant(p) for p in sorted(HERE.glob("*.patch"))]
    unknown = [w for w in options.mutants if not any(w in (m.name, m.number) for m in mutants)]
    if unknown:
        raise Trouble(f"There is no mutant {unknown[0]}; known are {mutants[0].name} to {mutants[-1].name}.")
    mutants = [m for m in mutants if not options.mutants or {m.name, m.number} & set(options.mutants)]
    WORK.mkdir(parents=True, exist_ok=True)
    lock = open(WORK / "lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise Trouble("Another run works in build/mutants.")
    commit = prepare()
    if options.check:
        rows = [m.name for m in mutants if not m.apply("--check")]
        for name in rows:
            print(f"{name} does not apply")
        print(f"{len(mutants) - len(rows)} of {len(mutants)} apply")
        return 1 if rows else 0

    results = {} if options.again or not RESULTS.exists() else json.loads(RESULTS.read_text())
    if results.get("commit") != commit:
        results = {"commit": commit, "base": {}, "mutants": {}}
    rows = []
    with open(WORK / "log.txt", "a") as log:
        sbt = Sbt(options.sbt, log)
        try:
            for m in mutants:
                if m.key() not in results["mutants"]:
                    log.write(f"=== {m.name}\n")
                    result, seconds = try_one(m, sbt, results["base"])
                    results["mutants"][m.key()] = [result, seconds]
                    RESULTS.write_text(json.dumps(results, indent=1))
                result, seconds = results["mutants"][m.key()]
                print(f"{m.name}: {result}, {seconds:.0f} s", flush=True)
                rows.append((m, result, seconds))
        finally:
            sbt.stop()
            git("checkout", "--force", ".", cwd=CHECKOUT)
    print()
    counts = show(rows)
    for m, result, _ in rows:
        if result != FOUND:
            print(f"{m.name}, {result}: {m.defect}")
    bad = counts[NOT_APPLIED] + counts[NOT_COMPILED] + counts[NO_BASE]
    return 1 if bad or counts[SURVIVED] > options.allowed else 0


def try_one(m, sbt, base):
    """The result for one mutant, and seconds without those of the suite's run without it."""
    git("checkout", "--force", ".", cwd=CHECKOUT)
    if not m.apply("--check"):
        return NOT_APPLIED, 0
    if m.suite not in base:
        base[m.suite] = run_suite(m.suite, sbt)
    if base[m.suite] != "passed":
        return NO_BASE, 0
    begin = time.monotonic()
    m.apply()
    result = {"passed": SURVIVED, "failed": FOUND, NOT_COMPILED: NOT_COMPILED}[run_suite(m.suite, sbt)]
    return result, time.monotonic() - begin


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that sbt ends too
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
    except Trouble as e:
        print(f"mutants: {e}", file=sys.stderr)
        sys.exit(2)
