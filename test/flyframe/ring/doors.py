#!/usr/bin/env python3
"""CAN programs at the doors of a simulated ring: python-can where it has the protocol, else bytes as the
protocol's description has them. The first argument says what is done; each prints one line when it was done
well, and ends with an exception if not."""
import random
import socket
import struct
import sys
import threading
import time

import can

# Seconds without a frame: on a bus the one with the last identifier waits until all others are through, on a
# slow machine for minutes.
PATIENCE = 600
WINDOW = 200  # frames under way


def any_frame(rng, remote=False):
    extended = rng.random() < 0.5
    is_remote = remote and rng.random() < 0.2
    data = bytes(rng.getrandbits(8) for _ in range(rng.randrange(9)))
    return can.Message(
        arbitration_id=rng.getrandbits(29 if extended else 11),
        is_extended_id=extended,
        is_remote_frame=is_remote,
        dlc=len(data),
        data=None if is_remote else data,
    )


def key(m):
    return m.arbitration_id, m.is_extended_id, m.is_remote_frame, m.dlc, bytes(m.data)


class CannelloniOnUdp:
    """Version 2 over UDP, which python-can has not, with the two calls of a bus that are needed here."""

    def __init__(self, port, own=0):
        self.peer = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", own))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.sequence, self.wanted, self.waiting = 0, None, []
        self.socket.sendto(struct.pack(">BBBH", 2, 0, 255, 0), self.peer)  # so that we are known

    def send(self, m):
        word = m.arbitration_id | m.is_extended_id << 31 | m.is_remote_frame << 30
        head = struct.pack(">BBBHIB", 2, 0, self.sequence, 1, word, m.dlc)
        self.socket.sendto(head + (b"" if m.is_remote_frame else bytes(m.data)), self.peer)
        self.sequence = (self.sequence + 1) % 256

    def recv(self, timeout):
        self.socket.settimeout(timeout)
        while not self.waiting:
            try:
                datagram = self.socket.recv(65536)
            except socket.timeout:
                return None
            version, code, number, count = struct.unpack_from(">BBBH", datagram)
            assert (version, code) == (2, 0), datagram
            assert self.wanted in (None, number), f"datagram {number} came, not {self.wanted}"
            self.wanted, at = (number + 1) % 256, 5
            for _ in range(count):
                word, length = struct.unpack_from(">IB", datagram, at)
                carried = 0 if word >> 30 & 1 else length
                data = datagram[at + 5 : at + 5 + carried]
                assert len(data) == carried
                at += 5 + carried
                self.waiting.append(
                    can.Message(
                        arbitration_id=word & 0x1FFFFFFF,
                        is_extended_id=bool(word >> 31),
                        is_remote_frame=bool(word >> 30 & 1),
                        dlc=length,
                        data=data,
                    )
                )
            assert at == len(datagram)
        return self.waiting.pop(0)

    def shutdown(self):
        self.socket.close()


def door(kind, where):
    if kind == "slcan":
        return can.Bus(interface="slcan", channel=where, sleep_after_open=0)
    if kind == "socketcand":
        return can.Bus(interface="socketcand", host="127.0.0.1", port=int(where), channel="can0")
    if kind == "socketcan":
        return can.Bus(interface="socketcan", channel=where)
    if kind == "cannelloni":
        return can.Bus(interface="cannelloni", channel=f"127.0.0.1:{where}")
    return CannelloniOnUdp(int(where))


def exchange(first, there, second, here, count, seed, doubles="no"):
    """As many frames each way, in order, none lost or changed. On a CAN bus with errors one may come twice in
    a row: the error may be in the last bit (CAN-13)."""
    rng = random.Random(int(seed))
    count = int(count)
    buses = [door(first, there), door(second, here)]
    # The one has no remote frames, the other none with a DLC.
    remote = not {"socketcand", "cannelloni"} & {first, second}
    sent = [[any_frame(rng, remote) for _ in range(count)] for _ in buses]
    # Two nodes never have the same identifier: their data would collide, up to bus-off.
    for side in (0, 1):
        for m in sent[side]:
            m.arbitration_id = m.arbitration_id & ~1 | side
    got = [[], []]

    def reader(i):
        while len(got[i]) < count:
            m = buses[i].recv(PATIENCE)
            if m is None:
                return
            if m.is_error_frame:
                continue
            if doubles == "no" or not got[i] or key(m) != key(got[i][-1]):
                got[i].append(m)

    readers = [threading.Thread(target=reader, args=(i,)) for i in (0, 1)]
    for r in readers:
        r.start()
    for n in range(count):
        while any(n - len(g) > WINDOW for g in got) and all(r.is_alive() for r in readers):
            time.sleep(0.001)
        for i in (0, 1):
            buses[i].send(sent[i][n])
    for r in readers:
        r.join()
    for i in (0, 1):
        expected, found = [key(m) for m in sent[1 - i]], [key(m) for m in got[i]]
        assert len(found) == count, f"{len(found)} of {count} frames came to {(first, second)[i]}"
        assert found == expected, next(pair for pair in zip(found, expected) if pair[0] != pair[1])
    for b in buses:
        b.shutdown()
    print(f"{count} frames each way between {first} and {second}")


def passes(bus, other, rng):
    """The next good frame from one door to the other passes."""
    m = any_frame(rng)
    bus.send(m)
    while True:
        found = other.recv(PATIENCE)
        assert found is not None, "the good frame did not come"
        if key(found) == key(m):
            return


def hostile(slcan, socketcand, cannelloni, rounds, seed):
    """What is no frame and no command is refused, and stops nobody."""
    rng = random.Random(int(seed))
    listener = door("socketcand", socketcand)
    adapter = door("slcan", slcan)
    station = CannelloniOnUdp(int(cannelloni))
    stream = door("cannelloni", cannelloni)
    silent = socket.create_connection(("127.0.0.1", int(socketcand)))  # opens the bus, and never reads
    silent.sendall(b"< open can0 >< rawmode >")
    for _ in range(int(rounds)):
        # slcan: random bytes, commands cut and changed; then the line is ended, and the channel opened.
        with open(slcan, "wb", buffering=0) as line:
            for _ in range(rng.randrange(1, 10)):
                text = rng.choice(
                    [
                        bytes(rng.getrandbits(8) for _ in range(rng.randrange(60))),
                        b"t12" + bytes([rng.randrange(32, 127)]) + b"8" + b"0" * rng.randrange(20) + b"\r",
                        b"T2000000000\r",
                        b"t8000\r",
                        b"t1239" + b"00" * 9 + b"\r",
                        rng.choice([b"S9\r", b"S\r", b"Z2\r", b"x\r", b"O1\r", b"\r\r\r", b"F\r", b"V\r"]),
                    ]
                )
                line.write(text.replace(b"C", b"").replace(b"O", b"").replace(b"L", b"").replace(b"Z1", b""))
            line.write(b"\r")
        # socketcand: a client of its own, which leaves in the midst.
        with socket.create_connection(("127.0.0.1", int(socketcand))) as c:
            c.sendall(rng.choice([b"", b"< open can0 >", b"< open can0 >< rawmode >", b"< open moon >"]))
            for _ in range(rng.randrange(1, 10)):
                c.sendall(
                    rng.choice(
                        [
                            bytes(rng.getrandbits(8) for _ in range(rng.randrange(600))),
                            b"< send 800 0 >",
                            b"< send 123 9 1 2 3 4 5 6 7 8 9 >",
                            b"< send 123 2 1 >",
                            b"< send 20000000 0 >",
                            b"< send xyz 1 1 >",
                            b"<<<<< > > >",
                            b"< send 123 1 ",
                            b"< " + b"a" * rng.randrange(1000),
                        ]
                    )
                )
        # cannelloni: wrong versions and codes, counts that lie, frames cut and too long.
        for _ in range(rng.randrange(1, 10)):
            good = struct.pack(">BBBHIB", 2, 0, rng.randrange(256), 1, 0x123, 2) + b"ab"
            station.socket.sendto(
                rng.choice(
                    [
                        bytes(rng.getrandbits(8) for _ in range(rng.randrange(100))),
                        good[: rng.randrange(len(good))],
                        good + b"c",
                        b"\x01" + good[1:],
                        good[:1] + b"\x07" + good[2:],
                        good[:3] + b"\xff\xff" + good[5:],
                        struct.pack(">BBBHIB", 2, 0, 0, 1, 0x800, 0),
                        struct.pack(">BBBHIB", 2, 0, 0, 1, 0x20000088, 8) + bytes(8),
                        struct.pack(">BBBHIB", 2, 0, 0, 1, 0x123, 9) + bytes(9),
                        struct.pack(">BBBHIB", 2, 0, 0, 1, 0x123, 0x80 | 8) + bytes(9),
                    ]
                ),
                station.peer,
            )
        # The same over TCP: a wrong welcome, or what is no frame; then it leaves.
        with socket.create_connection(("127.0.0.1", int(cannelloni))) as c:
            c.sendall(rng.choice([b"", b"CANNELLONIv2", b"CANNELLONI", b"CANNELLONIv1", b"CANNELLONIv1"]))
            c.sendall(
                rng.choice(
                    [
                        bytes(rng.getrandbits(8) for _ in range(rng.randrange(100))),
                        struct.pack(">IB", 0x123, 9) + bytes(9),
                        struct.pack(">IB", 0x800, 0),
                        struct.pack(">IB", 0x123, 8),
                        struct.pack(">IB", 0x123, 0x80 | 65) + bytes(66),
                    ]
                )
            )
        for bus in (adapter, station, stream):
            passes(bus, listener, rng)
        passes(listener, adapter, rng)
    for b in (listener, adapter, station, stream):
        b.shutdown()
    silent.close()
    print(f"{rounds} rounds")


def streams(cannelloni, socketcand, slcan):
    """Clients of cannelloni over TCP that are silent, leave and lie; the first two doors are at one node."""
    adapter, place = door("slcan", slcan), ("127.0.0.1", int(cannelloni))

    def came(m):
        found = adapter.recv(PATIENCE)
        assert found is not None and key(found) == key(m), (found, m)

    silent = [socket.create_connection(place) for _ in range(20)]  # more than there are places
    station, neighbour = door("cannelloni", cannelloni), door("socketcand", socketcand)
    # python-can waits for data behind a DLC.
    adapter.send(can.Message(arbitration_id=1, is_extended_id=False, is_remote_frame=True, dlc=4))
    adapter.send(can.Message(arbitration_id=2, is_extended_id=False, data=b"abc"))
    found = [station.recv(PATIENCE) for _ in range(2)]
    assert [key(m)[:4] for m in found] == [(1, False, True, 0), (2, False, False, 3)], found
    assert neighbour.recv(PATIENCE).arbitration_id == 2  # it has no remote frames
    # First clients of their doors.
    for bus, other in ((station, neighbour), (neighbour, station)):
        m = can.Message(arbitration_id=3, is_extended_id=False, data=b"d")
        bus.send(m)
        came(m)
        assert key(other.recv(PATIENCE)) == key(m)
    # Frames of one that leaves without having read anything, with one among them that cannot be.
    with socket.create_connection(place) as c:
        c.sendall(b"CANNELLONIv1" + struct.pack(">IB", 0x800, 0))
        c.sendall(b"".join(struct.pack(">IBB", 0x100 + i, 1, i) for i in range(100)))
    for i in range(100):
        came(can.Message(arbitration_id=0x100 + i, is_extended_id=False, data=bytes([i])))
    for b in (adapter, station, neighbour, *silent):
        b.close() if isinstance(b, socket.socket) else b.shutdown()
    print("all came")


def log(path):
    """A log of candump as python-can reads it: a line of identifier, data and kind for each frame."""
    for m in can.CanutilsLogReader(path):
        kind = "error" if m.is_error_frame else "remote" if m.is_remote_frame else "data"
        print(f"{m.timestamp:.6f} {m.arbitration_id:X} {int(m.is_extended_id)} {kind} {bytes(m.data).hex()}")


if __name__ == "__main__":
    {"exchange": exchange, "hostile": hostile, "streams": streams, "log": log}[sys.argv[1]](*sys.argv[2:])
