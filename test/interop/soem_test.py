#!/usr/bin/env python3
"""SOEM (by pysoem) as the master of simulated slaves.

Usage: soem_test.py INTERFACE CONTROL-SOCKET SCENARIO SLAVES [CYCLES]

The slaves are those of make_network.py. Prints a line per check; exit code 1 if one is wrong.
"""

import contextlib
import socket
import struct
import sys
import time

import pysoem

from digital_io import Digital
from make_network import PRODUCT, REVISION, SIZES, VENDOR, crc8

INTERFACE, CONTROL, SCENARIO, SLAVES = *sys.argv[1:4], int(sys.argv[4])
RING_INTERFACE = "veth-back"  # of run.sh
CYCLES = int(sys.argv[5]) if len(sys.argv) > 5 else 10_000
FULL_WKC = 3 * SLAVES  # 1 for reading, 2 for writing
AL_STATUS, AL_STATUS_CODE, DL_STATUS, EEPROM_STATUS = 0x0130, 0x0134, 0x0110, 0x0502
DETECTOR_DEBOUNCE = 0x0EA0
DELAY = 0x0928
CORE_CYCLE_NS = 10
SYNC_US = 1000
PORT_1 = 1 << 5 | 3 << 10  # DL status: link, loop closed, communication
SAFEOP_ERROR = pysoem.SAFEOP_STATE + pysoem.STATE_ERROR
# Time-outs as they are by default, in us of the master's clock.
TIMEOUTS = pysoem.settings.timeouts
FRAME, EEPROM, STATE = TIMEOUTS.ret, TIMEOUTS.eeprom, TIMEOUTS.state
LAG = 16  # cycles until a slave's inputs show its outputs, at most
failures = 0


class Wrong(Exception):
    pass


def check(name, ok, detail=""):
    """A check without which the rest makes no sense."""
    global failures
    print(
        ("ok    " if ok else "WRONG ") + name + (f": {detail}" if detail != "" and not ok else ""), flush=True
    )
    if not ok:
        failures += 1
        raise Wrong


class Simulator:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.lines = self.socket.makefile("rw")

    def ask(self, text):
        self.lines.write(text + "\n")
        self.lines.flush()
        answer = self.lines.readline().strip()
        if not answer.startswith("ok"):
            raise RuntimeError(f"'{text}' answered by '{answer}'")
        return answer[3:]


def pattern(slave, cycle):
    """The outputs of a cycle: the first byte tells which, the others depend on all."""
    return bytes(
        [cycle & 0xFF]
        + [(cycle * 37 + slave * 11 + i * (cycle >> 3 | 1)) & 0xFF for i in range(1, SIZES[slave][0])]
    )


def looped(slave, cycle):
    """These outputs as the host program returns them."""
    size = SIZES[slave][1]
    return pattern(slave, cycle)[:size].ljust(size, b"\0")


class Bus:
    def __init__(self):
        self.simulator = Simulator(CONTROL)
        self.overlap = False
        self.master = pysoem.Master()
        self.master.open(INTERFACE, RING_INTERFACE if SCENARIO == "ring" else None)

    def close(self):
        self.master.close()

    def scan(self):
        count = self.master.config_init()
        check(f"{SLAVES} slaves are found", count == SLAVES, count)

    def register(self, slave, address, size):
        return int.from_bytes(self.master.slaves[slave]._fprd(address, size, FRAME), "little")

    def state_of(self, slave):
        return self.register(slave, AL_STATUS, 2), self.register(slave, AL_STATUS_CODE, 2)

    def states(self):
        self.master.read_state()
        return [(s.state, s.al_status) for s in self.master.slaves]

    def safeop(self):
        (self.master.config_overlap_map if self.overlap else self.master.config_map)()
        state = self.master.state_check(pysoem.SAFEOP_STATE, STATE)
        check("all reach SAFEOP", state == pysoem.SAFEOP_STATE, [self.state_of(i) for i in range(SLAVES)])
        sizes = [(len(s.output), len(s.input)) for s in self.master.slaves]
        check("the mapping is that of the EEPROM", sizes == SIZES[:SLAVES], sizes)
        check(
            "the expected working counter is known",
            self.master.expected_wkc == FULL_WKC,
            self.master.expected_wkc,
        )

    def op(self):
        self.exchange()
        self.request(pysoem.OP_STATE, "OP")

    def request(self, state, name):
        self.master.state = state
        self.master.write_state()
        reached = self.master.state_check(state, STATE)
        check(f"all reach {name}", reached == state, [self.state_of(i) for i in range(SLAVES)])

    def exchange(self):
        (self.master.send_overlap_processdata if self.overlap else self.master.send_processdata)()
        return self.master.receive_processdata(FRAME)

    def cycle(self, count, wkc=FULL_WKC):
        """Process data cycles: working counters, and inputs that show the outputs of an earlier cycle, none
        of them torn."""
        shown = [None] * SLAVES
        for c in range(count):
            for i, s in enumerate(self.master.slaves):
                s.output = pattern(i, c)
            got = self.exchange()
            if got != wkc:
                check(f"working counter of cycle {c}", False, f"{got} instead of {wkc}")
            for i, s in enumerate(self.master.slaves):
                at = next((k for k in range(c, max(c - LAG, -1), -1) if s.input == looped(i, k)), None)
                if at is None and c < LAG:
                    continue  # what was there before
                if at is None or (shown[i] is not None and at < shown[i]):
                    check(
                        f"inputs of slave {i} in cycle {c}",
                        False,
                        f"{s.input.hex()} after outputs {pattern(i, c).hex()}",
                    )
                shown[i] = at
        check(
            f"{count} cycles with working counter {wkc}, outputs come back as inputs",
            count < LAG or None not in shown,
        )


def scan(bus):
    bus.scan()
    for i, s in enumerate(bus.master.slaves):
        check(f"slave {i}: name", s.name == f"flyframe-io-{i}", s.name)
        check(
            f"slave {i}: identity",
            (s.man, s.id, s.rev) == (VENDOR, PRODUCT + i, REVISION),
            (s.man, s.id, s.rev),
        )
        serial = struct.unpack("<I", s.eeprom_read(0x0E, EEPROM))[0]
        check(f"slave {i}: serial number", serial == 1000 + i, serial)
        check(f"slave {i}: alias", bus.register(i, 0x0012, 2) == 0x0100 + i)


def cycles(bus, count=CYCLES):
    bus.scan()
    bus.safeop()
    bus.op()
    start = time.monotonic()
    bus.cycle(count)
    print(f"      {(time.monotonic() - start) / count * 1e6:.0f} us per cycle")
    for state, name in (
        (pysoem.SAFEOP_STATE, "SAFEOP"),
        (pysoem.PREOP_STATE, "PREOP"),
        (pysoem.INIT_STATE, "INIT"),
    ):
        bus.request(state, name)


def star(bus):
    """The first slave has four ports, with others behind all of them."""
    bus.scan()
    bus.safeop()
    bus.op()
    links = [bus.register(i, DL_STATUS, 2) >> 4 & 0xF for i in range(SLAVES)]
    check("the links are those of the star", links == [0xF, 1, 3, 1, 1], links)
    bus.cycle(CYCLES // 10)


def clocks(bus):
    """Crystals and cables differ: the master measures delays and starts SYNC0; then its frame is repeated, so
    that simulated time goes faster. sync_pulses.py looks at the pulses."""
    bus.scan()
    check("slaves with clocks are found", bus.master.config_dc())
    delays = [bus.register(i, DELAY, 4) for i in range(SLAVES)]
    loops = [float(ns) for ns in bus.simulator.ask("loops").split()]
    true = [(loops[0] - loop) / 2 for loop in loops]
    print(f"      delays {delays}, true {true} ns")
    wrong = [d for d, t in zip(delays, true) if abs(d - t) > CORE_CYCLE_NS]
    check(
        "delays are those of frames on the mean within a core cycle", len(true) == SLAVES and not wrong, wrong
    )
    bus.safeop()
    for s in bus.master.slaves:
        s.dc_sync(True, SYNC_US * 1000)
    bus.op()
    got = bus.exchange()
    check("the clock's datagram does not disturb process data", got == FULL_WKC, got)
    bus.simulator.ask(f"repeat {CYCLES} {SYNC_US}")


def overlap(bus):
    """Inputs and outputs of a slave at the same logical addresses; `cycles` has all outputs, then all
    inputs."""
    bus.overlap = True
    cycles(bus, CYCLES // 5)


def lrd_lwr(bus):
    """The EEPROMs forbid LRW: inputs by LRD, outputs by LWR."""
    cycles(bus, CYCLES // 5)


def alarm(bus):
    """The second slave has a smoke detector, with nothing to report: it is as the others."""
    scan(bus)
    check("slave 1 has a detector", bus.register(1, DETECTOR_DEBOUNCE, 2) == 1000)
    cycles(bus, CYCLES // 5)


def cable(bus):
    """Cut in the middle of the line for longer than the watchdog, and mended."""
    bus.scan()
    short_watchdogs(bus)
    bus.safeop()
    bus.op()
    bus.cycle(50)
    at = SLAVES // 2
    port = lambda: bus.register(at - 1, DL_STATUS, 2) & PORT_1
    check(
        "DL status of the slave before it: port 1 is open and communicates",
        port() == 1 << 5 | 2 << 10,
        port(),
    )
    bus.simulator.ask(f"cut {at}")
    counters = set()
    for _ in range(30):
        counters.add(bus.exchange())
        bus.simulator.ask("advance 300")
    check("behind the cut nobody answers, before it all do", counters == {3 * at}, counters)
    check("DL status of the slave before it: port 1 has no link and is closed", port() == 1 << 10, port())
    check("the lost link is counted", bus.register(at - 1, 0x0311, 1) == 1)
    bus.simulator.ask(f"mend {at}")
    bus.simulator.ask("advance 100")
    check("after mending all answer", bus.exchange() == FULL_WKC)
    check("DL status of the slave before it: port 1 is open again", port() == 1 << 5 | 2 << 10, port())
    states = [bus.state_of(i) for i in range(SLAVES)]
    wanted = [(pysoem.OP_STATE, 0) if i < at else (SAFEOP_ERROR, 0x001B) for i in range(SLAVES)]
    check(
        "those behind it are in SAFEOP by their watchdogs, the others still in OP", states == wanted, states
    )
    recover(bus)
    bus.cycle(50)


def ring(bus):
    """With both ends at the master: cut at each place, mended, and cut at the next."""
    bus.scan()
    bus.safeop()
    bus.op()
    bus.cycle(20)
    for at in range(SLAVES + 1):
        bus.simulator.ask(f"cut {at}")
        bus.cycle(20)
        states = [state for state, _ in bus.states()]
        check(f"cut before slave {at}: all stay in OP", states == [pysoem.OP_STATE] * SLAVES, states)
        bus.simulator.ask(f"mend {at}")
        bus.cycle(20)
    states = [bus.state_of(i) for i in range(SLAVES)]
    check("mended: all are in OP", states == [(pysoem.OP_STATE, 0)] * SLAVES, states)


def short_watchdogs(bus):
    for s in bus.master.slaves:
        # 5 ms; set_watchdog() has a fixed timeout, too short here
        s._fpwr(0x0420, struct.pack("<H", 50), FRAME)


def recover(bus):
    """Slaves whose watchdog has expired get their error acknowledged and go to OP again."""
    bus.master.read_state()
    for s in bus.master.slaves:
        if s.state == SAFEOP_ERROR:
            s.state = pysoem.SAFEOP_STATE + pysoem.STATE_ACK
            s.write_state()
    bus.request(pysoem.SAFEOP_STATE, "SAFEOP")
    bus.op()


def refuse(bus):
    bus.scan()
    bus.simulator.ask("host 1 refuse safeop 0x001d")
    bus.master.config_map()
    wanted = [
        (pysoem.PREOP_STATE + pysoem.STATE_ERROR, 0x001D) if i == 1 else (pysoem.SAFEOP_STATE, 0)
        for i in range(SLAVES)
    ]
    end = time.monotonic() + STATE * 1e-6
    while (states := bus.states()) != wanted and time.monotonic() < end:
        pass
    check("the refusing slave stays in PREOP, with its AL status code", states == wanted, states)
    bus.simulator.ask("host 1 accept safeop")
    s = bus.master.slaves[1]
    s.state = pysoem.PREOP_STATE + pysoem.STATE_ACK
    s.write_state()
    check(
        "the error is acknowledged",
        s.state_check(pysoem.PREOP_STATE, STATE) == pysoem.PREOP_STATE,
        bus.state_of(1),
    )
    s.state = pysoem.SAFEOP_STATE
    s.write_state()
    check(
        "then SAFEOP is reached",
        s.state_check(pysoem.SAFEOP_STATE, STATE) == pysoem.SAFEOP_STATE,
        bus.state_of(1),
    )
    bus.op()
    bus.cycle(50)


def watchdog(bus):
    bus.scan()
    short_watchdogs(bus)
    bus.safeop()
    bus.op()
    bus.cycle(50)
    bus.simulator.ask("advance 20000")
    states = bus.states()
    check(
        "without process data all fall to SAFEOP, with code 0x001b",
        states == [(SAFEOP_ERROR, 0x001B)] * SLAVES,
        states,
    )
    expired = [bus.register(i, 0x0442, 1) for i in range(SLAVES)]
    check("the expiry is counted", expired == [1] * SLAVES, expired)
    recover(bus)
    bus.cycle(50)


def digital(bus):
    """Slaves without a processor."""
    bus.scan()
    short_watchdogs(bus)
    Digital(bus, check, FULL_WKC).run(CYCLES // 10)


def eeprom(bus):
    """Slave 1 has an EEPROM with a wrong checksum, which the master then repairs."""
    bus.scan()
    loaded = [bus.register(i, DL_STATUS, 2) & 1 for i in range(SLAVES)]
    check(
        "all but the slave with the corrupt EEPROM have loaded it",
        loaded == [i != 1 for i in range(SLAVES)],
        loaded,
    )
    errors = [bus.register(i, EEPROM_STATUS, 2) >> 11 & 3 for i in range(SLAVES)]
    check("its EEPROM status tells so", errors == [3 * (i == 1) for i in range(SLAVES)], errors)
    bus.master.config_map()
    counters = {bus.exchange() for _ in range(20)}
    check("it takes no part in process data", counters == {FULL_WKC - 3}, counters)
    s = bus.master.slaves[1]
    area = b"".join(s.eeprom_read(word, EEPROM)[:2] for word in range(7))
    s.eeprom_write(7, bytes([crc8(area), 0]), EEPROM)
    bus.simulator.ask("advance 6000")  # the chip answers nothing while it writes
    s._fpwr(EEPROM_STATUS, struct.pack("<H", 0x0400), FRAME)  # reload
    bus.simulator.ask("advance 1000")
    status = bus.register(1, EEPROM_STATUS, 2), bus.register(1, DL_STATUS, 2) & 1
    check("with the checksum repaired it loads", (status[0] & 0x9800, status[1]) == (0, 1), status)
    bus.request(pysoem.INIT_STATE, "INIT")
    bus.scan()
    bus.safeop()
    bus.op()
    bus.cycle(50)


bus = Bus()
with contextlib.suppress(Wrong):
    globals()[SCENARIO](bus)
bus.close()
sys.exit(1 if failures else 0)
