#!/usr/bin/env python3
"""SOEM (by pysoem) as the master of the slave stack's demonstration: `make slave-demo`, and scenario `stack`.

Usage: soem_stack.py INTERFACE CONTROL-SOCKET stack 1 [TRANSFERS]

Prints what it does and what it sees; exit code 1 if something is wrong.
"""

import contextlib
import socket
import struct
import sys

import pysoem

INTERFACE, CONTROL = sys.argv[1:3]
TRANSFERS = int(sys.argv[5]) if len(sys.argv) > 5 else 20
FRAME = pysoem.settings.timeouts.ret
STATE = pysoem.settings.timeouts.state
FILE_US = 1_000_000  # for a packet
FIRMWARE = "firmware.bin"
failures = 0


class Wrong(Exception):
    pass


def check(name, ok, seen=""):
    global failures
    print(f"{'ok   ' if ok else 'WRONG'} {name}" + (f": {seen}" if seen != "" else ""), flush=True)
    if not ok:
        failures += 1
        raise Wrong


def tell(text):
    print(f"      {text}", flush=True)


def bench(command):
    with socket.socket(socket.AF_UNIX) as s:
        s.connect(CONTROL)
        lines = s.makefile("rw")
        lines.write(command + "\n")
        lines.flush()
        return lines.readline().strip()


def abort_of(action):
    try:
        action()
    except pysoem.SdoError as e:
        return e.abort_code & 0xFFFFFFFF
    return 0


def state(master, slave, wanted, name):
    slave.state = wanted
    slave.write_state()
    reached = slave.state_check(wanted, STATE)
    check(f"the slave goes to {name}", reached == wanted, f"AL status 0x{slave.state:02x}")


def dictionary(slave):
    objects = slave.od
    tell("the object dictionary, as the slave describes it:")
    for o in objects:
        names = [e.name.decode() for e in o.entries[1:4]]
        tell(f"  0x{o.index:04x} {o.name.decode()}" + (f": {', '.join(names)} ..." if names else ""))
    check("20 objects", len(objects) == 20, len(objects))


def parameters(slave):
    for sub, form, name in (
        (1, "<H", "invert inputs"),
        (2, "<H", "mask of outputs"),
        (3, "<B", "filter"),
        (4, "<i", "offset"),
        (5, "<f", "gain"),
        (6, "<B", "enabled"),
        (7, "<B", "blinking"),
        (8, "<Q", "plant"),
    ):
        tell(f"parameter {sub}, {name}: {struct.unpack(form, slave.sdo_read(0x8000, sub))[0]}")
    slave.sdo_write(0x8000, 1, struct.pack("<H", 0x00FF))
    slave.sdo_write(0x8000, 3, b"\x0a")
    check("inputs are to be inverted, the filter is 10 ms", slave.sdo_read(0x8000, 3) == b"\x0a")
    code = abort_of(lambda: slave.sdo_write(0x8000, 3, b"\x65"))
    check("101 ms is refused", code == 0x06090031, f"0x{code:08x}")
    code = abort_of(lambda: slave.sdo_read(0x3000, 0))
    check("an object that there is not", code == 0x06020000, f"0x{code:08x}")
    identity = slave.sdo_read(0x1018, 0, ca=True)
    check("identity by complete access", identity == struct.pack("<H4I", 4, 0, 3, 1, 0), identity.hex())


def transfers(slave, exchange=lambda: None):
    """Every kind of SDO, none lost."""
    for i in range(TRANSFERS):
        exchange()
        short = struct.pack("<i", i % 2000 - 1000)
        slave.sdo_write(0x8000, 4, short)
        if slave.sdo_read(0x8000, 4) != short:
            check(f"expedited transfer {i}", False)
        normal = struct.pack("<Q", i * 0x123456789ABCDEF % 2**64)
        slave.sdo_write(0x8000, 8, normal)
        if slave.sdo_read(0x8000, 8) != normal:
            check(f"normal transfer {i}", False)
        if i % 4 == 0:
            note = bytes((i + k) % 251 for k in range(300))
            slave.sdo_write(0x2000, 0, note)
            if slave.sdo_read(0x2000, 0, size=400) != note:
                check(f"segmented transfer {i}", False)
            if slave.sdo_read(0x8000, 0, size=64, ca=True)[:2] != b"\x08\x00":
                check(f"complete access {i}", False)
    tell(f"{TRANSFERS} transfers expedited and normal each way, a quarter of that segmented and complete")


def mapping(slave):
    slave.sdo_write(0x1A00, 0, b"\x00")
    slave.sdo_write(0x1A00, 1, struct.pack("<I", 0x60100010))
    slave.sdo_write(0x1A00, 2, struct.pack("<I", 0x60000110))
    slave.sdo_write(0x1A00, 0, b"\x02")
    check("temperature and inputs are mapped", slave.sdo_read(0x1A00, 0) == b"\x02")
    slave.sdo_write(0x1A00, 0, b"\x00")
    slave.sdo_write(0x1A00, 1, struct.pack("<I", 0x70000110))
    code = abort_of(lambda: slave.sdo_write(0x1A00, 0, b"\x01"))
    check("an output as an input is refused", code == 0x06040041, f"0x{code:08x}")
    slave.sdo_write(0x1A00, 1, struct.pack("<I", 0x60100010))
    slave.sdo_write(0x1A00, 0, b"\x02")


def process_data(master, slave):
    emergencies = []
    slave.add_emergency_callback(emergencies.append)

    def exchange(outputs, lamp=0):
        slave.output = struct.pack("<HB", outputs, lamp)
        for _ in range(3):
            master.send_processdata()
            wkc = master.receive_processdata(FRAME)
        if wkc != 3:
            check("working counter", False, wkc)
        return struct.unpack("<hHH", slave.input)

    exchange(0)
    state(master, slave, pysoem.OP_STATE, "OP")
    temperature, inputs, _ = exchange(0x1234, 1)
    check("inputs are outputs, inverted as the parameter says", inputs == 0x1234 ^ 0x00FF, f"0x{inputs:04x}")
    check("the temperature is among the process data", temperature == 215, f"{temperature / 10} degrees")
    tell(f"the device says: {bench('host 0 status')}")
    transfers(slave, lambda: exchange(0x0001))
    exchange(0x8000)
    for _ in range(20):
        slave.mbx_receive()
        if emergencies:
            break
    check(
        "output 15 overloads the device",
        [e.error_code for e in emergencies] == [0x2310],
        [f"emergency 0x{e.error_code:04x}, error register 0x{e.error_reg:02x}" for e in emergencies],
    )
    exchange(0)


def firmware(version, size):
    body = struct.pack("<II", 0x57464646, version) + bytes(i * 7 % 256 for i in range(size - 9))
    return body + bytes([-sum(body) % 256])


def bootstrap(master, slave):
    new = firmware(2, 4001)
    state(master, slave, pysoem.INIT_STATE, "INIT")
    slave.amend_mbx("out", 0x1000, 256)
    slave.amend_mbx("in", 0x1100, 256)
    state(master, slave, 3, "BOOT")
    tell(f"writing {FIRMWARE}, {len(new)} bytes; the device is busy now and then")
    written = slave.foe_write(FIRMWARE, 0, new, FILE_US)
    check("the firmware is written", written > 0, written)
    check("and read back the same", slave.foe_read(FIRMWARE, 0, 8192, FILE_US) == new)
    broken = new[:-1] + bytes([new[-1] ^ 1])
    try:
        result = slave.foe_write(FIRMWARE, 0, broken, FILE_US)
    except Exception as e:  # pysoem has several
        result = f"{type(e).__name__} {e}"
    check("one with a wrong sum is refused", not isinstance(result, int) or result <= 0, result)
    check("the right one once more", slave.foe_write(FIRMWARE, 0, new, FILE_US) > 0)
    state(master, slave, pysoem.INIT_STATE, "INIT")
    slave.amend_mbx("out", 0x1000, 128)
    slave.amend_mbx("in", 0x1080, 128)
    state(master, slave, pysoem.PREOP_STATE, "PREOP")
    version = struct.unpack("<I", slave.sdo_read(0x2001, 0))[0]
    check("the device runs the new firmware", version == 2, f"version {version}")


master = pysoem.Master()
master.open(INTERFACE, None)
with contextlib.suppress(Wrong):
    found = master.config_init()
    check("a slave is found", found == 1, master.slaves[0].name if found else found)
    device = master.slaves[0]
    check("it reaches PREOP", device.state_check(pysoem.PREOP_STATE, STATE) == pysoem.PREOP_STATE)
    dictionary(device)
    parameters(device)
    mapping(device)
    master.config_map()
    reached = master.state_check(pysoem.SAFEOP_STATE, STATE)
    check(
        "SAFEOP with the new mapping",
        reached == pysoem.SAFEOP_STATE,
        f"{len(device.output)} bytes out, {len(device.input)} in, code 0x{device.al_status:04x}",
    )
    process_data(master, device)
    bootstrap(master, device)
master.close()
sys.exit(1 if failures else 0)
