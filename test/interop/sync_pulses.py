#!/usr/bin/env python3
"""Judges pulses of SYNC0 that flyframe-cosim has written: how far those of all slaves are apart.

Usage: sync_pulses.py FILE SLAVES [--settled CYCLES] [--within NS] [--out FILE]

Prints a line per check; exit code 1 if one is wrong.
"""

import argparse
import bisect
import pathlib
import sys

CYCLE_NS = 1_000_000


def pulses_of(path):
    """Times of the pulses of SYNC0, ns, by slave."""
    pulses = {}
    for line in path.read_text().splitlines():
        slave, signal, level, ns = line.split()
        if (signal, level) == ("0", "1"):
            pulses.setdefault(int(slave), []).append(float(ns))
    return [pulses[i] for i in sorted(pulses)]


def spreads(pulses):
    """For each pulse of the first slave while all have some: its time, and how far those of all are apart.

    A master tells each slave its start time by itself, so that one may begin a cycle later.
    """
    first, last = max(p[0] for p in pulses), min(p[-1] for p in pulses)
    for at in pulses[0]:
        if not first - CYCLE_NS / 2 < at < last + CYCLE_NS / 2:
            continue
        times = [at]
        for others in pulses[1:]:
            i = bisect.bisect(others, at)
            times.append(min(others[max(i - 1, 0) : i + 1], key=lambda t: abs(t - at)))
        yield at, max(times) - min(times)


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("file", type=pathlib.Path)
parser.add_argument("slaves", type=int)
parser.add_argument("--settled", type=int, default=0, help="cycles at the beginning that do not count")
parser.add_argument("--within", type=float, default=5000, help="ns that they may be apart")
parser.add_argument(
    "--out", type=pathlib.Path, help="file to write: time in s and ns apart, a line per cycle"
)
args = parser.parse_args()

pulses = pulses_of(args.file)
counts = [len(p) for p in pulses]
apart = list(spreads(pulses)) if pulses else []
gaps = [b - a for p in pulses for a, b in zip(p, p[1:])]
worst = max((ns for _, ns in apart[args.settled :]), default=float("inf"))
checks = {
    f"SYNC0: all slaves have pulses ({counts})": len(pulses) == args.slaves
    and max(counts) - min(counts) <= 1,
    "SYNC0: none is lost or doubled": bool(gaps) and all(abs(gap - CYCLE_NS) < 2000 for gap in gaps),
    f"SYNC0: {worst:.0f} ns apart at most, {apart[-1][1] if apart else 0:.0f} at the end": worst
    <= args.within,
}
for name, ok in checks.items():
    print(("ok    " if ok else "WRONG ") + name)
if args.out:
    args.out.write_text("".join(f"{(at - apart[0][0]) / 1e9:.6f} {ns:.2f}\n" for at, ns in apart))
sys.exit(not all(checks.values()))
