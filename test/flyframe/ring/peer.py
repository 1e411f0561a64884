#!/usr/bin/env python3
"""A node of the fibre ring's transport, written from its rules alone (docs/rules/transport.md), on
python-can: sends messages to another node and takes those that come. When its standard input ends, as many
as wanted have to have come, and all of its own to have ended; until then it answers, as others may not have
heard that it has all. Prints a JSON object: what was sent with its outcome, and what came.

Times are those of the wall, long enough for a ring that is simulated slowly."""
import argparse
import json
import random
import sys
import threading
import time
import zlib

import can

OPEN, SHORT, CLOSE, DONE, MISSING, BUSY, UNKNOWN, HELLO = 1, 2, 3, 0x11, 0x12, 0x13, 0x14, 0x20
PROCESS_DATA = 15


def identifier(urgent, destination, is_data, source, number, pipe, end):
    high = (0 if urgent else 1) << 28 | destination << 21 | int(is_data) << 20
    return high | source << 13 | number << 5 | pipe << 1 | int(end)


class Outgoing:
    def __init__(self, pipe, number, data):
        self.pipe, self.number, self.data = pipe, number, data
        self.parts = [data[i : i + 8] for i in range(0, len(data), 8)]
        self.begin()
        self.tries, self.wait, self.outcome = 0, None, None

    def begin(self):
        """OPEN or SHORT, and all frames (TP-04)."""
        self.opening = True
        self.todo = [] if len(self.data) <= 6 else list(range(len(self.parts)))
        self.left = None


class Peer:
    def __init__(self, bus, address, life, answer_s, gap_s):
        self.bus, self.address, self.life = bus, address, life
        self.answer_s, self.gap_s = answer_s, gap_s
        self.outgoing, self.sent, self.received = [], [], []
        self.free, self.numbers = set(range(15)), {}
        self.lives, self.pipes = {}, {}  # of sources; by source and pipe: number last delivered, open message

    def put(self, destination, code, pipe, data, is_data=False, number=None, end=True):
        number = code if number is None else number
        word = identifier(False, destination, is_data, self.address, number, pipe, end)
        self.bus.send(can.Message(arbitration_id=word, is_extended_id=True, data=bytes(data)))

    # ---- sender (TP-01 to TP-13) ----

    def start(self, destination, data):
        pipe = min(self.free)  # TP-01
        self.free.discard(pipe)
        number = self.numbers.get((destination, pipe), 0)
        self.numbers[destination, pipe] = (number + 1) % 256
        m = Outgoing(pipe, number, data)
        m.destination = destination
        self.outgoing.append(m)

    def send_some(self, now):
        """A frame of each message in turn (TP-05)."""
        for m in list(self.outgoing):
            if m.wait is not None:
                if now < m.wait:
                    continue
                m.wait = None
                m.begin()
            if m.opening:
                head = [m.number, self.life]
                if len(m.data) <= 6:
                    self.put(m.destination, SHORT, m.pipe, head + list(m.data))
                else:
                    size = (len(m.data) - 1).to_bytes(2, "big")
                    crc = zlib.crc32(m.data).to_bytes(4, "big")
                    self.put(m.destination, OPEN, m.pipe, head + list(size) + list(crc))
                m.opening, m.left = False, now
            elif m.todo:
                n = m.todo.pop(0)
                self.put(m.destination, 0, m.pipe, m.parts[n], True, n, n == len(m.parts) - 1)
                m.left = now
            elif now > m.left + self.answer_s:  # TP-12
                m.tries += 1
                if m.tries == 10:
                    self.put(m.destination, CLOSE, m.pipe, [m.number, self.life])
                    self.end(m, "not confirmed")
                m.opening = True

    def end(self, m, outcome):
        self.outgoing.remove(m)
        self.free.add(m.pipe)
        self.sent.append({"data": m.data.hex(), "outcome": outcome})

    def answered(self, source, code, pipe, d, now):
        for m in list(self.outgoing):
            if m.destination != source or m.pipe != pipe:
                continue
            if code == UNKNOWN:  # TP-11
                m.begin()
            elif d[0] == m.number and d[1] == self.life:
                m.tries, m.left = 0, now
                if code == DONE and d[3] == 2:
                    m.begin()
                elif code == DONE:
                    self.end(m, "delivered" if d[3] == 0 else "refused")
                elif code == MISSING:
                    bits = int.from_bytes(d[3:8], "big")
                    named = [d[2] + i for i in range(40) if bits >> (39 - i) & 1]
                    m.todo = sorted(set(m.todo) | set(named))
                elif code == BUSY:
                    m.wait = now + max(d[2] * 0.01, self.gap_s)

    # ---- receiver (TP-20 to TP-25) ----

    def known(self, source, life):
        """Whether the life is the source's; a newer one begins all of its pipes anew (TP-20)."""
        before = self.lives.get(source)
        if before is not None and 1 <= (before - life) % 128 <= 63:
            return False
        if life != before:
            self.lives[source] = life
            for key in [k for k in self.pipes if k[0] == source]:
                del self.pipes[key]
        return True

    def done(self, source, pipe, number):
        self.put(source, DONE, pipe, [number, self.lives[source], self.life, 0])

    def opened(self, source, code, pipe, d, now):
        if not self.known(source, d[1] & 0x7F):
            return
        p = self.pipes.setdefault((source, pipe), {"last": None, "open": None})
        if p["last"] is not None:
            if d[0] == p["last"]:
                return self.done(source, pipe, d[0])
            if (d[0] - p["last"]) % 256 > 127:
                return
        if code == SHORT:
            self.received.append(bytes(d[2:]).hex())
            p.update(last=d[0], open=None)
            return self.done(source, pipe, d[0])
        size, crc = int.from_bytes(d[2:4], "big") + 1, int.from_bytes(d[4:8], "big")
        o = p["open"]
        if o is None or (o["number"], o["size"], o["crc"]) != (d[0], size, crc):
            o = {"number": d[0], "size": size, "crc": crc, "parts": {}, "heard": now, "highest": None}
            p["open"] = {**o, "sent": 0, "alone": True}
        else:
            o["heard"], o["alone"] = now, True
            if o["parts"]:  # at once: the ring's time may be slower than the wall's
                o["sent"] = (size + 7) // 8
                self.ask(source, pipe, p)

    def ask(self, source, pipe, p):
        """Names the first frames that were sent and are missing (TP-23, TB-30)."""
        o = p["open"]
        count = (o["size"] + 7) // 8
        if len(o["parts"]) == count:
            return self.complete(source, pipe, p)
        missing = [n for n in range(o["sent"]) if n not in o["parts"]]
        if not missing:
            return
        named = [n for n in missing if n < missing[0] + 40]
        o["highest"] = named[-1]
        bits = sum(1 << (39 - (n - missing[0])) for n in named)
        head = [o["number"], self.lives[source], missing[0]]
        self.put(source, MISSING, pipe, head + list(bits.to_bytes(5, "big")))

    def complete(self, source, pipe, p):
        o = p["open"]
        data = b"".join(o["parts"][n] for n in sorted(o["parts"]))
        if len(data) != o["size"] or zlib.crc32(data) != o["crc"]:  # TP-24
            o["parts"], o["sent"] = {}, 0
            return self.put(source, DONE, pipe, [o["number"], self.lives[source], self.life, 2])
        self.received.append(data.hex())
        p.update(last=o["number"], open=None)
        self.done(source, pipe, p["last"])

    def part(self, source, number, pipe, end, d, now):
        p = self.pipes.get((source, pipe))
        if p is None:
            return self.put(source, UNKNOWN, pipe, [0])
        o = p["open"]
        if o is None:  # TP-25
            return self.done(source, pipe, p["last"]) if p["last"] is not None else None
        count = (o["size"] + 7) // 8
        length = 8 if number < count - 1 else o["size"] - 8 * (count - 1)
        if number >= count or len(d) != length or end != (number == count - 1) or number in o["parts"]:
            return  # TP-22
        o["parts"][number], o["heard"], o["alone"] = bytes(d), now, False
        o["sent"] = max(o["sent"], number + 1)
        if end or len(o["parts"]) == count or number == o["highest"]:
            self.ask(source, pipe, p)

    # ---- both ----

    def take(self, m, now):
        if m.is_error_frame or m.is_remote_frame or not m.is_extended_id:
            return
        word, d = m.arbitration_id, list(m.data)
        destination, source = word >> 21 & 0x7F, word >> 13 & 0x7F
        number, pipe, end = word >> 5 & 0xFF, word >> 1 & 0xF, bool(word & 1)
        if destination != self.address or pipe == PROCESS_DATA:
            return
        if word >> 20 & 1:
            self.part(source, number, pipe, end, d, now)
        elif number in (OPEN, SHORT):
            self.opened(source, number, pipe, d, now)
        elif number == CLOSE:
            self.pipes.get((source, pipe), {})["open"] = None
        else:
            self.answered(source, number, pipe, d, now)

    def run(self, destination, messages, wanted, patience_s):
        waiting, end = list(messages), time.monotonic() + patience_s
        stays = threading.Thread(target=sys.stdin.read, daemon=True)
        stays.start()
        self.put(0, HELLO, 0, [self.life, 0, 0, 0, 0, 0, 0, 1])
        while stays.is_alive() or waiting or self.outgoing or len(self.received) < wanted:
            now = time.monotonic()
            assert now < end, f"{len(self.sent)} messages have ended, {len(self.received)} came"
            while waiting and self.free:
                self.start(destination, waiting.pop(0))
            self.send_some(now)
            while (m := self.bus.recv(0.002)) is not None:
                self.take(m, time.monotonic())
            for (source, pipe), p in self.pipes.items():
                o = p["open"]
                if o and now > o["heard"] + self.gap_s:
                    o["heard"] = now
                    if o["alone"]:  # OPEN: all was sent, or the message has waited
                        o["sent"] = (o["size"] + 7) // 8
                    self.ask(source, pipe, p)


if __name__ == "__main__":
    a = argparse.ArgumentParser(description=__doc__)
    a.add_argument("--channel", required=True, help="of slcan")
    a.add_argument("--address", type=int, required=True)
    a.add_argument("--to", type=int, required=True)
    a.add_argument("--messages", type=int, required=True, help="that are sent")
    a.add_argument("--longest", type=int, default=2048, help="bytes of a message that is sent")
    a.add_argument("--wanted", type=int, required=True, help="that are to come")
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--patience", type=float, default=300)
    o = a.parse_args()
    rng = random.Random(o.seed)
    sizes = [1, 6, 7, 8, 9, o.longest] + [rng.randint(1, o.longest) for _ in range(o.messages)]
    with can.Bus(interface="slcan", channel=o.channel, sleep_after_open=0) as bus:
        peer = Peer(bus, o.address, life=1, answer_s=10, gap_s=4)
        data = [bytes(rng.getrandbits(8) for _ in range(n)) for n in sizes[: o.messages]]
        peer.run(o.to, data, o.wanted, o.patience)
    print(json.dumps({"sent": peer.sent, "received": peer.received}))
