#!/usr/bin/env python3
"""SOEM (by pysoem) as the master of the slave stack's demonstration: `make slave-demo`, and scenarios `stack`
and `stack_sync`.

Usage: soem_stack.py INTERFACE CONTROL-SOCKET SCENARIO 1 TRANSFERS FILE-BYTES

Prints what it does and what it sees; exit code 1 if something is wrong.
"""

import contextlib
import socket
import struct
import sys

import pysoem

INTERFACE, CONTROL, SCENARIO = sys.argv[1:4]
TRANSFERS, FILE_BYTES = map(int, sys.argv[5:7])
FRAME = pysoem.settings.timeouts.ret
STATE = pysoem.settings.timeouts.state
FILE_US = 1_000_000  # for a packet
SYNC_US = 200
FIRMWARE = "firmware.bin"
PACKET = 256 - 12  # bytes of a file in a mailbox of Bootstrap
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
        note = bytes((i + k) % 251 for k in range(300))
        slave.sdo_write(0x2000, 0, note)
        if slave.sdo_read(0x2000, 0, size=400) != note:
            check(f"segmented transfer {i}", False)
        if slave.sdo_read(0x8000, 0, size=64, ca=True) != b"\x08\x00" + all_parameters(short, normal):
            check(f"complete access {i}", False)
        if i % 1000 == 999:
            tell(f"{i + 1} transfers of each kind")
    check("SDO transfers of each kind both ways, with process data beside them", True, TRANSFERS)


def all_parameters(offset, plant):
    """As complete access has them: five numbers, and bit by bit enabled, blinking and the plant."""
    numbers = struct.pack("<HHB", 0x00FF, 0xFFFF, 10) + offset + struct.pack("<f", 1.0)
    return numbers + (1 | struct.unpack("<Q", plant)[0] << 3).to_bytes(9, "little")


def complete_downloads(slave):
    """Not all parameters may be written in OP."""
    for i in range(TRANSFERS):
        whole = all_parameters(struct.pack("<i", i % 999), struct.pack("<Q", i * 0x9E3779B97F4A7C15 % 2**64))
        slave.sdo_write(0x8000, 1, whole, ca=True)
        if slave.sdo_read(0x8000, 1, size=64, ca=True) != whole:
            check(f"complete access {i}", False)
    check("complete access both ways", True, TRANSFERS)


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


def write(slave, data):
    """Whether a file was written."""
    with contextlib.suppress(Exception):  # pysoem has several
        return slave.foe_write(FIRMWARE, 0, data, FILE_US) > 0
    return False


def read(slave, most):
    """What pysoem makes of a file: when the transfer fails, something else than the file."""
    with contextlib.suppress(Exception):
        return slave.foe_read(FIRMWARE, 0, most, FILE_US)
    return None


def broken_off(slave):
    """The device refuses each packet of a short file in turn; the master leaves it behind each packet."""
    new = firmware(3, 5 * PACKET + 1)
    writes = reads = leaves = True
    for n in range(6):
        bench(f"host 0 refuse {n}")
        writes = writes and not write(slave, new)
        bench("host 0 refuse -1")
        writes = writes and write(slave, new)
        bench(f"host 0 refuse {n}")
        reads = reads and read(slave, 8192) != new
        bench("host 0 refuse -1")
        reads = reads and read(slave, 8192) == new
        if n > 0:
            left = read(slave, n * PACKET - 1) != new
            left = left and bench("host 0 status").endswith(f", packets {n}")
            leaves = leaves and left and read(slave, 8192) == new
    check("each packet refused in turn, and the same file written right behind it", writes)
    check("each packet refused to be read, and the file read right behind it", reads)
    check("the master leaves the file at each packet, and reads it right behind that", leaves)


def bootstrap(master, slave):
    new = firmware(2, FILE_BYTES)
    state(master, slave, pysoem.INIT_STATE, "INIT")
    slave.amend_mbx("out", 0x1000, 256)
    slave.amend_mbx("in", 0x1100, 256)
    state(master, slave, 3, "BOOT")
    tell(f"writing {FIRMWARE}, {len(new)} bytes; the device is busy at each packet")
    bench("host 0 busy 1")
    check("the firmware is written", write(slave, new))
    check("and read back the same", read(slave, FILE_BYTES + PACKET) == new)
    bench("host 0 busy 8")
    broken_off(slave)
    short = firmware(2, 4001)
    broken = short[:-1] + bytes([short[-1] ^ 1])
    check("one with a wrong sum is refused", not write(slave, broken))
    check("the right one once more", write(slave, short))
    state(master, slave, pysoem.INIT_STATE, "INIT")
    slave.amend_mbx("out", 0x1000, 128)
    slave.amend_mbx("in", 0x1080, 128)
    state(master, slave, pysoem.PREOP_STATE, "PREOP")
    version = struct.unpack("<I", slave.sdo_read(0x2001, 0))[0]
    check("the device runs the new firmware", version == 2, f"version {version}")


def synchronized(master, slave):
    """SYNC mode: a cycle of the program with each SYNC0."""
    check("the slave has clocks", master.config_dc())
    slave.dc_sync(True, SYNC_US * 1000)
    master.config_map()
    reached = master.state_check(pysoem.SAFEOP_STATE, STATE)
    check("SAFEOP with SYNC0", reached == pysoem.SAFEOP_STATE, f"code 0x{slave.al_status:04x}")

    def exchange(outputs):
        slave.output = struct.pack("<HB", outputs, 0)
        master.send_processdata()
        if master.receive_processdata(FRAME) != 3:
            check("working counter", False)
        return struct.unpack("<HH", slave.input)  # inputs, which are the outputs, and the cycles

    # SOEM has SYNC0 begin in 100 ms.
    begin = exchange(0)[1]
    check("no cycle before the first SYNC0", exchange(0)[1] == begin, begin)
    bench("advance 101000")
    exchange(0)
    state(master, slave, pysoem.OP_STATE, "OP")
    exchange(0x1234)
    bench(f"advance {2 * SYNC_US}")
    check("outputs act with SYNC0", exchange(0x1234)[0] == 0x1234)
    # Two frames in a cycle of SYNC0; they are those of the last exchange.
    before = exchange(0x1234)[1]
    bench(f"repeat 400 {SYNC_US // 2}")
    cycles = exchange(0x1234)[1] - before
    check("as many cycles as SYNC0", 198 <= cycles <= 203, cycles)
    master.read_state()
    check("still in OP", slave.state == pysoem.OP_STATE)
    bench(f"advance {6 * SYNC_US}")
    master.read_state()
    check("SYNC0 without outputs", (slave.state, slave.al_status) == (0x14, 0x001A), hex(slave.al_status))
    slave.state = pysoem.SAFEOP_STATE | 0x10
    slave.write_state()
    exchange(0)
    state(master, slave, pysoem.OP_STATE, "OP again")
    slave.dc_sync(False, 0)
    for _ in range(103):
        exchange(0)
    master.read_state()
    check("outputs without SYNC0", (slave.state, slave.al_status) == (0x14, 0x002D), hex(slave.al_status))


def everything(master, device):
    dictionary(device)
    parameters(device)
    complete_downloads(device)
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


master = pysoem.Master()
master.open(INTERFACE, None)
with contextlib.suppress(Wrong):
    found = master.config_init()
    check("a slave is found", found == 1, master.slaves[0].name if found else found)
    the_device = master.slaves[0]
    check("it reaches PREOP", the_device.state_check(pysoem.PREOP_STATE, STATE) == pysoem.PREOP_STATE)
    (synchronized if SCENARIO == "stack_sync" else everything)(master, the_device)
master.close()
sys.exit(1 if failures else 0)
