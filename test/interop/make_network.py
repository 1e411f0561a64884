#!/usr/bin/env python3
"""Writes a network file of N slaves with an EEPROM image each, all for the host program "io" of
flyframe-cosim.

Usage: make_network.py FOLDER N [--preset NAME] [--second NAME] [--corrupt SLAVE] [--no-lrw] [--ring]
                       [--star NAME] [--clocks NAME] [--digital NAME] [--stack [--sync NAME]]

Slave i has SIZES[i] bytes of outputs and inputs; its name, product code, alias and serial number tell which
one it is. SOEM takes slaves with equal vendor, product and revision for copies of the first and does not read
their EEPROMs.
"""

import argparse
import json
import pathlib
import struct

SIZES = [(8, 8), (3, 5), (4, 2), (1, 1), (16, 16)]
VENDOR, PRODUCT, REVISION = 0xF1F1F1F1, 0x00F1_0001, 0x0001_0002  # for tests only, nobody's
# Of a star, in the order in which a frame reaches them: by ports 3, 1 and 2 of the first.
BEHIND = {
    1: {"behind": 0, "port": 3},
    2: {"behind": 0, "port": 1},
    3: {"behind": 2, "port": 1},
    4: {"behind": 0, "port": 2},
}
# Crystals within 100 ppm that drift, and cables of 1 to 100 m. With a frame per ms, 40 ppm between neighbours
# are one period of the transmit clock per frame. Neighbours that are apart by a multiple of that make all
# frames wait for the same time for seconds, which no slave can average: none are.
CLOCKS = [
    {"clock_ppm": ppm, "drift_ppm": 1, "drift_s": 3, "cable_ns": ns}
    for ppm, ns in ((94, 5), (-97, 500), (48, 70), (-22, 255), (81, 150))
]
OUTPUTS, INPUTS = 0x1000, 0x1100  # three buffers each; in 1 KiB of RAM


def crc8(data):
    c = 0xFF
    for b in data:
        c ^= b
        for _ in range(8):
            c = (c << 1 ^ 7) & 0xFF if c & 0x80 else c << 1
    return c


def category(kind, data):
    data += bytes(len(data) % 2)
    return struct.pack("<HH", kind, len(data) // 2) + data


def pdo(index, sync_manager, first_object, size):
    # type 5: UINT8
    entries = b"".join(struct.pack("<HBBBBH", first_object, 1 + i, 0, 5, 8, 0) for i in range(size))
    return struct.pack("<HBBBBH", index, size, sync_manager, 0, 0, 0) + entries


def image(i, corrupt, no_lrw):
    outputs, inputs = SIZES[i % len(SIZES)]
    # PDI: on-chip bus; pulses of SYNC signals: 10 us; alias
    area = struct.pack("<7H", 0x0080, 0, 1000, 0, 0x0100 + i, 0, 0)
    head = area + struct.pack("<H", crc8(area) ^ (0x5A if corrupt else 0))
    head += struct.pack("<4I", VENDOR, PRODUCT + i, REVISION, 1000 + i)
    head = head.ljust(0x3E * 2, b"\0") + struct.pack("<HH", 15, 1)  # 16 Kbit, version 1
    strings = [f"flyframe-io-{i}".encode(), b"flyframe"]
    flags = 2 if no_lrw else 0
    general = struct.pack("<BBBBBBBBBBBBHHHH", 2, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, flags, 0, 0, 0x0011, 0).ljust(
        32, b"\0"
    )
    managers = struct.pack("<HHBBBB", OUTPUTS, outputs, 0x64, 0, 1, 3) + struct.pack(
        "<HHBBBB", INPUTS, inputs, 0x20, 0, 1, 4
    )
    body = category(10, bytes([len(strings)]) + b"".join(bytes([len(s)]) + s for s in strings))
    body += category(30, general) + category(40, bytes([1, 2])) + category(41, managers)
    body += category(50, pdo(0x1A00, 1, 0x6000, inputs)) + category(51, pdo(0x1600, 0, 0x7000, outputs))
    return (head + body + b"\xff\xff").ljust(2048, b"\xff")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("slaves", type=int)
    parser.add_argument("--preset", default="slave")
    parser.add_argument("--second", help="preset of the second slave, if it is another")
    parser.add_argument("--corrupt", type=int, help="this slave's EEPROM has a wrong checksum")
    parser.add_argument("--no-lrw", action="store_true", help="the EEPROMs say that LRW must not be used")
    parser.add_argument("--ring", action="store_true", help="the last slave is connected to the master, too")
    parser.add_argument(
        "--star", help="preset of the first slave, with four ports, others behind all of them"
    )
    parser.add_argument("--clocks", help="preset of slaves with clocks, whose crystals and cables differ")
    parser.add_argument(
        "--digital",
        help="preset of slaves without a host, their inputs wired to their outputs; FILE.sii.bin is their "
        "EEPROM",
    )
    parser.add_argument("--stack", action="store_true", help="one slave: the slave stack's demonstration")
    parser.add_argument("--sync", help="preset of that slave, with clocks")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.stack:
        eeprom = pathlib.Path(__file__).resolve().parents[2] / "generated/slave-demo.sii.bin"
        slave = {"preset": args.sync or args.preset, "eeprom": str(eeprom), "host": "stack"}
        if args.sync:
            # SYNC0 is an event (0x0151 bit 3) that waits for its acknowledge (pulse length 0).
            area = struct.pack("<7H", 0x0080, 0x0800, 0, 0, 0, 0, 0)
            image = area + struct.pack("<H", crc8(area)) + eeprom.read_bytes()[16:]
            (args.folder / "sync.bin").write_bytes(image)
            slave["eeprom"] = "sync.bin"
        (args.folder / "net.json").write_text(json.dumps({"slaves": [slave]}, indent=1))
        raise SystemExit
    slaves = []
    for i in range(args.slaves):
        (args.folder / f"{i}.bin").write_bytes(image(i, i == args.corrupt, args.no_lrw))
        preset = args.second if i == 1 and args.second else args.preset
        slaves.append({"preset": preset, "eeprom": f"{i}.bin", "host": "io", "clock_ppm": 30 * (-1) ** i})
        if args.star and i == 0:
            slaves[i]["preset"] = args.star
        elif args.star:
            slaves[i].update(BEHIND[i])
        if args.clocks:
            slaves[i].update(CLOCKS[i], preset=args.clocks)
    if args.digital:
        (args.folder / "digital.bin").write_bytes(pathlib.Path(args.digital + ".sii.bin").read_bytes())
        preset = pathlib.Path(args.digital).name
        slaves = [
            {"preset": preset, "eeprom": "digital.bin", "wired": True, "clock_ppm": s["clock_ppm"]}
            for s in slaves
        ]
    (args.folder / "net.json").write_text(json.dumps({"slaves": slaves, "ring": args.ring}, indent=1))
