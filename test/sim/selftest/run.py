#!/usr/bin/env python3
"""Proves the simulator on repeaters: what must pass passes, what must be found is found.

Usage: run.py FOLDER-OF-PROGRAMS"""

import json
import pathlib
import random
import re
import struct
import subprocess
import sys
import zlib

OUT = pathlib.Path(sys.argv[1])
failures = []


def run(program, *args, stdin=""):
    r = subprocess.run(
        [OUT / f"flyframe-{program}", *map(str, args)], input=stdin, capture_output=True, text=True
    )
    return r.returncode, r.stdout, r.stderr


def check(name, ok, detail=""):
    print(("ok    " if ok else "WRONG ") + name)
    if not ok:
        failures.append(name)
        print(detail)


def write_pcap(path, frames):
    """frames: (ns, bytes)"""
    with open(path, "wb") as f:
        f.write(struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, 1))
        for ns, data in frames:
            f.write(struct.pack("<IIII", ns // 10**9, ns % 10**9, len(data), len(data)) + data)


def read_pcap(path):
    raw, frames, at = path.read_bytes(), [], 24
    assert struct.unpack_from("<I", raw)[0] == 0xA1B23C4D, "not a pcap file with nanoseconds"
    while at < len(raw):
        s, ns, size, _ = struct.unpack_from("<IIII", raw, at)
        frames.append((s * 10**9 + ns, raw[at + 16 : at + 16 + size]))
        at += 16 + size
    return frames


def network(path, *slaves, **more):
    path.write_text(json.dumps({"slaves": list(slaves), **more}))
    return path


rng = random.Random(1)


def master_frame(size):
    return bytes(6) + b"\x00\x01\x02\x03\x04\x05" + bytes([0x88, 0xA4]) + rng.randbytes(size - 14)


# --- flyframe-cosim: a line returns every frame, padded, in order, and late by what the cables add
sizes = [14, 59, 60, 61, 1514] + [rng.randrange(14, 1515) for _ in range(40)]
frames = [(1_000_000 * i // 7, master_frame(n)) for i, n in enumerate(sizes)]
returned_ones = [(t + 1, b[:6] + b"\x02" + b[7:]) for t, b in frames]
write_pcap(OUT / "in.pcap", sorted(frames + returned_ones))
line = [
    {"preset": "repeater"},
    {"preset": "repeater-wide", "clock_ppm": 100, "cable_ns": 3000},
    {"preset": "repeater", "clock_ppm": -100},
]
net = network(OUT / "net.json", *line)
args = ["--network", net, "--replay", OUT / "in.pcap", "--out", OUT / "out.pcap"]
code, _, err = run("cosim", *args)
padded = [b.ljust(60, b"\0") for _, b in frames]
check(
    "a line of three returns all frames",
    code == 0 and "sent 45, returned 45, lost 0, bad FCS 0, runts 0" in err,
    err,
)
out = read_pcap(OUT / "out.pcap")
check("returned frames are the sent ones, padded", [b for _, b in out] == padded)
gaps = [b[0] - a[0] for a, b in zip(out, out[1:])]
wire = [(len(b) + 12) * 80 for b in padded]
planned = [b[0] - a[0] + (len(q) - len(p)) * 80 for a, b, p, q in zip(frames, frames[1:], padded, padded[1:])]
check(
    "frames leave at their recorded distance",
    all(abs(g - p) < 400 for g, p in zip(gaps, planned)),
    list(zip(gaps, planned)),
)
first_out = out[0][0]
run("cosim", *args, "--no-skip")
check("idle time in full gives the same", [b for _, b in read_pcap(OUT / "out.pcap")] == padded)
run("cosim", *args, "--both")
both = read_pcap(OUT / "out.pcap")
check("--both records both, in order of time", len(both) == 90 and both == sorted(both, key=lambda f: f[0]))
latency = both[1][0] - both[0][0]
check("the way through is as long as the cables", 6_100 < latency < 8_000, latency)
write_pcap(OUT / "burst.pcap", [(0, b) for _, b in frames])
code, _, err = run(
    "cosim",
    "--network",
    net,
    "--replay",
    OUT / "burst.pcap",
    "--out",
    OUT / "out.pcap",
    "--trace",
    OUT / "t.fst",
)
out = read_pcap(OUT / "out.pcap")
gaps = [b[0] - a[0] - (len(b[1]) + 4 + 8 + 12) * 80 for a, b in zip(out, out[1:])]
check("frames at one time leave with the minimum gap", all(-200 < g < 200 for g in gaps), gaps)
check(
    "the trace is written without complaint",
    (OUT / "t.fst").stat().st_size > 1000 and err.count("\n") == 1,
    err,
)


# --- cables and crystals that are not as they should be
def through(*slaves, seed=None, **more):
    net = network(OUT / "net2.json", *slaves, **more)
    chosen = ["--seed", seed] if seed else []
    code, _, err = run(
        "cosim",
        "--network",
        net,
        "--replay",
        OUT / "in.pcap",
        "--out",
        OUT / "out.pcap",
        "--no-skip",
        *chosen,
    )
    assert code == 0, err
    counts = dict(re.findall(r"(\w[\w ]*?) (\d+)(?:,|$)", err.splitlines()[-1]))
    return {k: int(v) for k, v in counts.items()}, read_pcap(OUT / "out.pcap")


_, out = through(*line, ring=True)
check("a ring returns all frames at its other end", [b for _, b in out] == padded)
check("a ring's cable takes its time", through(*line, ring={"cable_ns": 9000})[1][0][0] - out[0][0] == 8950)
check(
    "drifting crystals lose no frame",
    [
        b
        for _, b in through(
            {"preset": "repeater", "drift_ppm": 50, "drift_s": 0.002},
            {"preset": "repeater-wide", "clock_ppm": 50, "drift_ppm": 50, "drift_s": 0.003},
            {"preset": "repeater", "clock_ppm": -100},
            master_ppm=-50,
        )[1]
    ]
    == padded,
)
noisy = {"preset": "repeater", "bit_errors": 60_000}
counts, out = through(noisy, line[2])
check("bit errors are seen as bad frames", 0 < counts["bad FCS"] < 40 and counts["lost"] == 0, counts)
check("and those that are good are right", all(b in padded for _, b in out))
check("the same seed gives the same errors", through(noisy, line[2])[1] == out)
check("another one gives others", through(noisy, line[2], seed=9)[1] != out)
counts, out = through({"preset": "repeater", "link_drops_per_s": 3000, "link_drop_us": 60}, line[2])
check("links that drop cut frames", counts["runts"] + counts["bad FCS"] > 0 and 5 < len(out) < 45, counts)
check("those that pass are right, too", all(b in padded for _, b in out))

(OUT / "huge.bin").write_bytes(bytes(4097))
(OUT / "large.bin").write_bytes(bytes(4096))
# --- mistakes: one sentence, exit code 2
for name, slave, words in [
    ("unknown preset", {"preset": "et9"}, "repeater, repeater-wide"),
    ("unknown key", {"preset": "repeater", "cable": 5}, "unknown key 'cable'"),
    ("bad value", {"preset": "repeater", "cable_ns": -1}, "cable_ns -1"),
    ("missing EEPROM image", {"preset": "repeater", "eeprom": "none.bin"}, "none.bin"),
    (
        "EEPROM image for no chip",
        {"preset": "repeater", "eeprom": "huge.bin"},
        "4097 bytes no known chip holds",
    ),
    (
        "EEPROM image too large",
        {"preset": "repeater", "eeprom": "large.bin", "eeprom_chip": "24C16"},
        "do not fit into the 2048 of a 24C16",
    ),
    (
        "unknown chip",
        {"preset": "repeater", "eeprom": "large.bin", "eeprom_chip": "24C64"},
        "known: 24C16, 24C32",
    ),
    (
        "EEPROM that cannot be saved",
        {"preset": "repeater", "eeprom": "large.bin", "eeprom_save": "none/x"},
        "cannot be written",
    ),
    ("chip without image", {"preset": "repeater", "eeprom_save": True}, "names no image"),
    ("unknown host program", {"preset": "repeater", "host": "robot"}, "known: none, io"),
    ("port that is not there", {"preset": "repeater", "port": 2}, "whose preset 'repeater' has 2"),
    ("port that is taken", {"preset": "repeater", "port": 0}, "lead to port 0 of slave 0"),
    ("cable to a later slave", {"preset": "repeater", "behind": 1}, "behind 1, but"),
    ("fraction of a bit", {"preset": "repeater", "bit_errors": 0.5}, "a whole number from 0"),
    ("drift without time", {"preset": "repeater", "drift_s": 0}, "from 0.001 to 1000000"),
]:
    bad = network(OUT / "bad.json", {"preset": "repeater"}, slave)
    code, _, err = run("cosim", "--network", bad, "--replay", OUT / "in.pcap", "--out", OUT / "out.pcap")
    check(f"{name} is told", code == 2 and words in err and err.count("\n") == 1, err)
for name, more, words in [
    ("ring that is none", {"ring": 3}, "neither true, false"),
    ("ring with an unknown key", {"ring": {"cable": 3}}, "unknown key 'cable'"),
    ("seed that is none", {"seed": -1}, "seed -1"),
    ("unknown key of a network", {"master": 1}, "known: slaves, ring, master_ppm, seed"),
]:
    bad = network(OUT / "bad.json", {"preset": "repeater"}, **more)
    code, _, err = run("cosim", "--network", bad, "--replay", OUT / "in.pcap", "--out", OUT / "out.pcap")
    check(f"{name} is told", code == 2 and words in err and err.count("\n") == 1, err)
for name, override in [
    ("missing capture", {1: OUT / "no.pcap"}),
    ("capture that is none", {1: net}),
    ("network that is no JSON", {0: OUT / "in.pcap"}),
]:
    files = [override.get(i, v) for i, v in enumerate([net, OUT / "in.pcap"])]
    code, _, err = run("cosim", "--network", files[0], "--replay", files[1], "--out", OUT / "out.pcap")
    check(f"{name} is told", code == 2 and err.count("\n") == 1, err)
code, _, err = run("cosim", "--nonsense")
check("unknown option is told", code == 2 and err.count("\n") == 1, err)
(OUT / "bad.bin").write_bytes(bytes(16))
code, _, err = run(
    "cosim", "--network", network(OUT / "bad.json", {"preset": "repeater", "eeprom": "bad.bin"}), *args[2:]
)
check(
    "an EEPROM image with a bad checksum is warned of", code == 0 and "0x30" in err and "warning" in err, err
)
(OUT / "good.bin").write_bytes(bytes.fromhex("050e030610270000000000000000d700"))
code, _, err = run(
    "cosim", "--network", network(OUT / "bad.json", {"preset": "repeater", "eeprom": "good.bin"}), *args[2:]
)
check("an EEPROM image with a good checksum is not", code == 0 and "warning" not in err, err)


# --- flyframe-fuzz
def nibbles(data):
    return "".join(f"{b & 15:x}{b >> 4:x}" for b in data)


def vectors(preset, shape, frames_, checks=("W 1001 5a", "R 1001 5a", "W 1003 a5", "R 1001 5a", "R 1003 a5")):
    text = [f"H 7 {preset} {shape}", "C 0 100", "C 1 -100", *checks]
    for i in range(frames_):
        data = master_frame(rng.randrange(60, 1500))
        data += zlib.crc32(data).to_bytes(4, "little")
        port, preamble, odd = i % 2, rng.randrange(3, 20), rng.choice(["", "7"])
        text.append(f"F {i} {port} {rng.randrange(24, 60)} {'5' * preamble}d{nibbles(data)}{odd}")
        text.append(f"X {1 - port} {preamble} {nibbles(data)}{odd}")
        if i % 5 == 4:
            text += ["Q", "I 0 3", "R 1001 5a"]
    return text


SHAPES = {"repeater": "2 4 8", "repeater-wide": "2 1 32"}
for preset, shape in SHAPES.items():
    good = vectors(preset, shape, 200)
    code, out_, err = run("fuzz", "--preset", preset, "--vectors", "-", stdin="\n".join(good))
    check(f"{preset}: right vectors pass", code == 0 and "frames 200, differences 0" in out_, out_ + err)
    at = next(i for i, l in enumerate(good) if l.startswith("X") and i > 60)

    def fuzz_with(lines):
        return run("fuzz", "--vectors", "-", stdin="\n".join(good[:at] + lines + good[at + 1 :]))

    x = good[at]
    frame_id = good[at - 1].split()[1]
    wrong = {
        "a wrong nibble": (
            [x[:-40] + ("1" if x[-40] == "0" else "0") + x[-39:]],
            "first difference at payload nibble",
        ),
        "a missing end": ([x[:-1]], "first difference at payload nibble"),
        "a wrong preamble": ([" ".join([*x.split()[:2], "2", x.split()[3]])], "preamble length differs"),
        "a frame nobody expects": (["X -"], "expected: nothing"),
        "a frame that does not come": ([x, "X 0 7 00", "Q"], "expected: preamble 7"),
        "a wrong byte": ([x, "R 1003 a4"], "host read of 0x1003"),
    }
    for name, (lines, words) in wrong.items():
        code, out_, err = fuzz_with(lines)
        ok = (
            code == 1
            and words in out_
            and "seed 7" in out_
            and f"frame {frame_id}" in out_
            and "received: frame" in out_
        )
        check(
            f"{preset}: {name} is found",
            ok or (name == "a frame nobody expects" and code == 1),
            out_[:600] + err,
        )
er = ["H 1 repeater 2 4 8", "F 0 0 30 5555555d123456 E8,10", "X 1 7 022456", "Q"]
code, out_, err = run("fuzz", "--vectors", "-", stdin="\n".join(er))
check("RX_ER reaches the pins at its symbol", code == 0, out_ + err)
down = [
    "H 1 repeater 2 4 8",
    "L 1 0",
    "F 0 0 30 5555555d123456",
    "X 0 7 123456",
    "X 1 7 123456",
    "Q",
    "L 0 0",
    "F 1 0 30 5555555d123456",
    "X -",
    "Q",
]
code, out_, err = run("fuzz", "--vectors", "-", stdin="\n".join(down))
check("a link goes down", code == 0, out_ + err)
for name, text in [
    ("bad digit", "H 1 repeater 2 4 8\nW 10g0 00"),
    ("no H line", "Q"),
    ("other shape", "H 1 repeater 2 4 16"),
    ("other preset", "H 1 none 2 4 8"),
]:
    code, out_, err = run("fuzz", "--vectors", "-", stdin=text)
    check(f"vectors with {name} are refused", code == 2 and err.count("\n") == 1, out_ + err)

# --- flyframe-latency: two synchroniser stages and the grey code register, a margin of one more symbol,
# then the next slot
code, out_, err = run("latency", "--preset", "repeater")
ways = json.loads(out_)
for way in "processing", "forwarding":
    r = ways[way]
    check(
        f"latency, {way}",
        r["worst_ns"] == 140
        and r["best_ns"] == 100.1
        and r["pin_to_pin_worst_ns"] == 160
        and r["worst_cycles"] == 14,
        out_,
    )

# --- flyframe-cosim on a network interface
own_net = ["unshare", "--user", "--net", "--map-root-user"]
if subprocess.run(
    [*own_net, "ip", "link", "add", "one", "type", "veth", "peer", "name", "two"], capture_output=True
).returncode:
    print("skipped: the tests on a network interface need unprivileged user namespaces and veth")
else:
    check(
        "on a network interface",
        subprocess.run([*own_net, pathlib.Path(__file__).parent / "live.py", OUT]).returncode == 0,
    )

print(f"{len(failures)} failed" if failures else "all passed")
sys.exit(1 if failures else 0)
