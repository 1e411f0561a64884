#!/usr/bin/env python3
"""SOEM (by pysoem) as the master of a gateway to a fibre ring (GW-01 to GW-03), whose nodes are all in RTL.

Usage: gateway.py INTERFACE CONTROL-SOCKET NODES CYCLES

The ring is that of `ring_of`: the gateway and NODES nodes behind it, addresses 2 on. Prints a line per check;
exit code 1 if one is wrong.
"""

import contextlib
import json
import socket
import struct
import sys
import time

import pysoem

FRAME = pysoem.settings.timeouts.ret
STATE = pysoem.settings.timeouts.state
OUTPUT_BYTES, INPUT_BYTES, SLOTS_AT, OUTPUTS_AT = 516, 540, 28, 4
WHOLE, RELAY, UP_1, UP_2 = 1, 2, 4, 8
VALID = 1  # of the control byte
WATCHDOG_TIME, AL_STATUS_CODE = 0x0420, 0x0134
WITHIN = 40  # cycles until something shows, at most
INPUT_TABLE, OUTPUT_TABLE = 0x8010, 0x8020
failures = 0


class Wrong(Exception):
    pass


def check(name, ok, seen=""):
    global failures
    print(("ok    " if ok else "WRONG ") + name + (f": {seen}" if seen != "" and not ok else ""), flush=True)
    if not ok:
        failures += 1
        raise Wrong


class Ring:
    """The simulator's control socket."""

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

    def ms(self):
        """Simulated time."""
        return int(self.ask("time").split()[0]) / 1e6

    def values(self, place):
        """What the node at this place of the ring follows: a (bytes, old) for each object of the gateway."""
        status = json.loads(self.ask("status"))["nodes"][place - 1]
        return {v["object"]: (bytes.fromhex(v["data"]), v["old"]) for v in status["values"]}


class Gateway:
    def __init__(self, interface, nodes):
        self.nodes = nodes
        self.master = pysoem.Master()
        self.master.open(interface)
        self.outputs = bytearray(OUTPUT_BYTES)
        self.cycles = self.lost = 0

    def scan(self):
        count = self.master.config_init()
        check("GW-01: one slave is found", count == 1, count)
        self.slave = self.master.slaves[0]
        check(
            "GW-01: its name is that of the EEPROM",
            self.slave.name == "flyframe-ring-gateway",
            self.slave.name,
        )

    def to(self, state, name):
        self.master.state = state
        self.master.write_state()
        reached = self.master.state_check(state, STATE)
        check(f"GW-01: {name}", reached == state, (reached, hex(self.code())))

    def code(self):
        return int.from_bytes(self.slave._fprd(AL_STATUS_CODE, 2, FRAME), "little")

    def safeop(self):
        self.master.config_map()
        reached = self.master.state_check(pysoem.SAFEOP_STATE, STATE)
        check("GW-01: SAFEOP", reached == pysoem.SAFEOP_STATE, (reached, hex(self.code())))
        sizes = (len(self.slave.output), len(self.slave.input))
        check("GW-02: as many bytes as the rule says", sizes == (OUTPUT_BYTES, INPUT_BYTES), sizes)

    def op(self):
        self.cycle()
        self.to(pysoem.OP_STATE, "OP")

    def cycle(self):
        self.slave.output = bytes(self.outputs)
        self.master.send_processdata()
        wkc = self.master.receive_processdata(FRAME)
        self.cycles += 1
        self.lost += wkc != self.master.expected_wkc
        return self.slave.input

    def until(self, name, shows, within=WITHIN):
        """Cycles until the inputs show something."""
        for _ in range(within):
            inputs = self.cycle()
            if shows(inputs):
                check(name, True)
                return
        check(name, False, (inputs[:SLOTS_AT].hex(), inputs[SLOTS_AT : SLOTS_AT + 8 * self.nodes].hex()))

    def put(self, slot, data):
        at = OUTPUTS_AT + 8 * slot
        self.outputs[at : at + 8] = data.ljust(8, b"\0")


def slot(inputs, n):
    return inputs[SLOTS_AT + 8 * n : SLOTS_AT + 8 * n + 8]


def is_valid(inputs, n):
    return inputs[20 + n // 8] >> n % 8 & 1 == 1


def shows(inputs, n, value):
    return is_valid(inputs, n) and slot(inputs, n) == value.ljust(8, b"\0")


def there(inputs):
    return {a for a in range(128) if inputs[4 + a // 8] >> a % 8 & 1}


def exchange(gateway, ring, cycles):
    """Each cycle one node tells a new value, and one gets one; both have come a few cycles later."""
    nodes = gateway.nodes
    told, put = {}, {}
    slowest_in = slowest_out = 0
    for place in range(2, nodes + 2):
        ring.ask(f"watch {place} 1 0")
    gateway.outputs[0] = VALID
    for c in range(cycles):
        n = c % nodes
        if n in told:
            inputs, waited = gateway.cycle(), 0
            while not shows(inputs, n, told[n]) and waited < WITHIN:
                inputs, waited = gateway.cycle(), waited + 1
            slowest_in = max(slowest_in, waited)
            if not shows(inputs, n, told[n]):
                check(f"GW-02: the value of node {n + 2}", False, (c, slot(inputs, n).hex(), told[n].hex()))
            value, waited = ring.values(n + 2).get(0), 0
            while value != (put[n], False) and waited < WITHIN:
                gateway.cycle()
                value, waited = ring.values(n + 2).get(0), waited + 1
            slowest_out = max(slowest_out, waited)
            if value != (put[n], False):
                check(f"GW-03: the output for node {n + 2}", False, (c, value, put[n].hex()))
        told[n] = bytes([c & 0xFF, c >> 8, *range(c % 7)])
        put[n] = bytes([c >> 8, c & 0xFF, n, 1, 2, 3, 4, 5])
        ring.ask(f"object {n + 2} 1 0 {told[n].hex()}")
        gateway.put(n, put[n])
        gateway.cycle()
    check(f"GW-02, GW-03: {cycles} values from {nodes} nodes and {cycles} to them", True)
    print(
        f"      {gateway.cycles} cycles, {gateway.lost} without an answer; "
        f"inputs shown {slowest_in} cycles late, outputs {slowest_out}"
    )
    check("GW-01: each cycle was answered", gateway.lost == 0, gateway.lost)


def soon(gateway, ring):
    """From a node's host to the master; the fastest counts, as this program may wait for a processor."""
    took = []
    for i in range(9):
        value = bytes([0xA0 + i])
        begin, waited = ring.ms(), 0
        ring.ask(f"object 2 1 0 {value.hex()}")
        while not shows(gateway.cycle(), 0, value) and waited < WITHIN:
            waited += 1
        took.append(ring.ms() - begin)
    took.sort()
    print(f"      inputs shown {took[0]:.3f} to {took[-1]:.3f} ms after the node's host has told them")
    check("GW-03: a new value is in the inputs within 1 ms", took[0] <= 1, took)


def abort_of(action):
    try:
        action()
    except pysoem.SdoError as e:
        return e.abort_code & 0xFFFFFFFF
    return 0


def tables(gateway):
    def write(index, subindex, number):
        return abort_of(lambda: gateway.slave.sdo_write(index, subindex, number.to_bytes(2, "little")))

    table = gateway.slave.sdo_read(INPUT_TABLE, 1)
    check("GW-02: the table of the device file", table == b"\x00\x02", table)
    check("GW-02: an impossible node is refused", write(INPUT_TABLE, 1, 0x7E00) == 0x06090030)
    check("GW-02: the gateway itself, too", write(OUTPUT_TABLE, 1, 0x0100) == 0x06090030)
    # Outputs for the nodes that are there, and no others; the last slots are for object 7 of node 2.
    nodes = [a << 8 if a < gateway.nodes + 2 else 0 for a in range(2, 66)]
    whole = struct.pack("<H64H", 64, *nodes)
    check(
        "GW-02: a table at once", abort_of(lambda: gateway.slave.sdo_write(OUTPUT_TABLE, 0, whole, True)) == 0
    )
    check(
        "GW-02: a slot for another object",
        write(INPUT_TABLE, 64, 0x0207) == write(OUTPUT_TABLE, 64, 0x0207) == 0,
    )


def breaks(gateway, ring):
    last = gateway.nodes + 1
    ring.ask("cut 3")
    gateway.until(
        "GW-02: a break between nodes 3 and 4", lambda i: not i[0] & WHOLE and tuple(i[2:4]) == (3, 4)
    )
    ring.ask(f"object {last} 1 0 a5")
    gateway.until("GW-02: values come through it", lambda i: slot(i, last - 2)[0] == 0xA5)
    ring.ask("mend 3")
    gateway.until("GW-02: whole again", lambda i: i[0] & WHOLE and tuple(i[2:4]) == (0, 0), 200)
    ring.ask(f"off {last}")
    gateway.until("GW-02: a node without power is not there", lambda i: last not in there(i), 200)
    gateway.until(
        "GW-02: nor is its value", lambda i: not is_valid(i, last - 2) and not any(slot(i, last - 2)), 200
    )
    ring.ask(f"on {last}")
    gateway.until("GW-02: it is there again", lambda i: last in there(i), 400)


def without_valid_value(ring, wait):
    begin = time.monotonic()
    while ring.values(2).get(0) != (b"", False) and time.monotonic() - begin < 60:
        wait()
    return ring.values(2).get(0) == (b"", False)


def outputs_end(gateway, ring):
    # All 64 outputs end at once, which takes as long as the watchdog.
    gateway.outputs[0] = 0
    has_ended = without_valid_value(ring, gateway.cycle)
    check("GW-03: without bit 0 the nodes have no valid value", has_ended, ring.values(2))
    gateway.outputs[0] = VALID
    gateway.until("GW-03: and again", lambda _: ring.values(2).get(0, (b"", True))[0] != b"")
    has_ended = without_valid_value(ring, lambda: time.sleep(0.1))
    check("GW-03: the watchdog expires: no valid value", has_ended, ring.values(2))
    check("GW-03: SAFEOP, watchdog", gateway.code() == 0x001B, hex(gateway.code()))


def main():
    interface, control = sys.argv[1:3]
    nodes, cycles = map(int, sys.argv[3:5])
    print(f"SOEM, pysoem {pysoem.__version__}: gateway with {nodes} nodes")
    ring, gateway = Ring(control), Gateway(interface, nodes)
    try:
        gateway.scan()
        tables(gateway)
        gateway.safeop()
        gateway.slave._fpwr(WATCHDOG_TIME, (50).to_bytes(2, "little"), FRAME)  # 5 ms
        gateway.op()
        everyone = set(range(1, nodes + 2))
        gateway.until(
            "GW-02: all nodes, the ring whole", lambda i: there(i) == everyone and i[0] == 0x0F, 400
        )
        gateway.cycles = gateway.lost = 0
        exchange(gateway, ring, cycles)
        soon(gateway, ring)
        ring.ask("watch 2 1 7")
        ring.ask("object 2 1 7 77")
        gateway.put(63, b"\x99")
        gateway.until("GW-02: the changed slots, in", lambda i: slot(i, 63)[0] == 0x77)
        gateway.until("GW-03: the changed slots, out", lambda _: ring.values(2)[7][0][:1] == b"\x99")
        breaks(gateway, ring)
        outputs_end(gateway, ring)
    finally:
        with contextlib.suppress(Exception):
            gateway.master.close()
    print("0 wrong")


if __name__ == "__main__":
    try:
        main()
    except Wrong:
        sys.exit(1)
