#!/usr/bin/env python3
"""Proves flyframe-cosim --interface on repeaters, inside a network namespace of its own. Usage (by run.py):
unshare --user --net --map-root-user live.py FOLDER-OF-PROGRAMS"""

import json
import pathlib
import random
import signal
import socket
import subprocess
import sys
import time

OUT = pathlib.Path(sys.argv[1]).resolve()
failures = []


def check(name, ok, detail=""):
    print(("ok    " if ok else "WRONG ") + name)
    if not ok:
        failures.append(name)
        print(detail)


def ip(*words):
    subprocess.run(["ip", *words], check=True)


ip("link", "add", "veth-master", "type", "veth", "peer", "name", "veth-slaves")
for name in "veth-master", "veth-slaves":
    (pathlib.Path("/proc/sys/net/ipv6/conf") / name / "disable_ipv6").write_text("1")
ip("link", "set", "veth-master", "up")

rng = random.Random(1)
HEADER = bytes(6) + b"\x00\x01\x02\x03\x04\x05" + bytes([0x88, 0xA4])
card = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
card.bind(("veth-master", 0))
card.settimeout(5)


def receive():
    while True:
        try:
            data, address = card.recvfrom(2048)
        except TimeoutError:
            return None
        if address[2] != socket.PACKET_OUTGOING:
            return data


def cosim(*args, interface="veth-slaves"):
    return [OUT / "flyframe-cosim", "--network", OUT / "live.json", "--interface", interface, *args]


def told(name, words, interface="veth-slaves", *args):
    r = subprocess.run(cosim(*args, interface=interface), capture_output=True, text=True)
    check(name, r.returncode == 2 and words in r.stderr and r.stderr.count("\n") == 1, r.stdout + r.stderr)


line = [
    {"preset": "repeater"},
    {"preset": "repeater-wide", "clock_ppm": 100},
    {"preset": "repeater", "clock_ppm": -100, "host": "io"},
]
(OUT / "live.json").write_text(json.dumps({"slaves": line}))
told("a missing interface is told", "there is no network interface 'none'.", "none")
told("an interface that is down is told", "is down")
ip("link", "set", "veth-slaves", "up")
r = subprocess.run(
    ["setpriv", "--bounding-set", "-net_raw", "--inh-caps", "-net_raw", *cosim()],
    capture_output=True,
    text=True,
)
check(
    "a lacking permission is told",
    r.returncode == 2 and "CAP_NET_RAW" in r.stderr and r.stderr.count("\n") == 1,
    r.stdout + r.stderr,
)


def begin(*args):
    process = subprocess.Popen(cosim(*args), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return process, process.stdout.readline()


process, ready = begin("--control", OUT / "live.sock")
check("readiness is told", ready == "joined veth-slaves: 3 slaves\n", ready)
frames = [HEADER + rng.randbytes(n) for n in [0, 45, 46, 47, 1500, *(rng.randrange(1500) for _ in range(45))]]
for f in frames:
    card.send(f)
back = [receive() for _ in frames]
check("a burst comes back, padded, in order", back == [f.ljust(60, b"\0") for f in frames])
one_by_one = []
for f in frames:
    time.sleep(rng.random() * 0.01)
    card.send(f)
    one_by_one.append(receive())
check("frames after idle time come back", one_by_one == [f.ljust(60, b"\0") for f in frames])
tagged = HEADER[:12] + b"\x81\x00\x20\x05" + HEADER[12:] + bytes(60)
card.send(tagged)
check("a VLAN tag passes", receive() in (tagged, HEADER + bytes(60)))

control = socket.socket(socket.AF_UNIX)
control.connect(str(OUT / "live.sock"))
lines = control.makefile("rw")


def ask(text):
    lines.write(text + "\n")
    lines.flush()
    return lines.readline().strip()


check("a wrong line is answered", ask("nonsense").startswith("error: known: cut"))
check("a wrong slave is answered", ask("cut 3") == "error: '3' is no number from 0 to 2.")
check("a slave without host program is answered", ask("host 0 stop").startswith("error: slave 0 has no host"))
check(
    "a host program answers",
    ask("host 2 refuse safeop 0x001d") == "ok" and ask("host 2 status").startswith("ok state init"),
)
check(
    "a host program refuses", ask("host 2 refuse nowhere 1").startswith("error: no state is called 'nowhere'")
)
before = int(ask("time").split()[1])
check(
    "simulated time advances when told",
    ask("advance 3000") == "ok" and int(ask("time").split()[1]) >= before + 3_000_000,
)
check("a cable is cut", ask("cut 0") == "ok")
card.settimeout(0.5)
card.send(frames[0])
check("nothing comes through it", receive() is None)
card.settimeout(5)
check("a cable is mended", ask("mend 0") == "ok")
card.send(frames[4])
check("frames come through it", receive() == frames[4])
before, start = int(ask("time").split()[1]), time.monotonic()
time.sleep(0.3)
check("time goes on while idle", int(ask("time").split()[1]) > before + 1_000_000)
check("quit is answered", ask("quit") == "ok")
err = process.communicate(timeout=10)[1]
check(
    "the statistics say it all",
    process.returncode == 0 and "received 103, returned 102, lost 1, stale 0, bad FCS 0, runts 0" in err,
    err,
)
check("the socket is gone", not (OUT / "live.sock").exists())

for scale, low, high in (0, 0, 0), (0.001, 400_000, 900_000):
    process, _ = begin("--time-scale", str(scale), "--control", OUT / "live.sock")
    used = lambda: sum(
        map(int, pathlib.Path(f"/proc/{process.pid}/stat").read_text().split(")")[1].split()[11:13])
    )
    control = socket.socket(socket.AF_UNIX)
    control.connect(str(OUT / "live.sock"))
    lines = control.makefile("rw")
    before, ticks = int(ask("time").split()[1]), used()
    time.sleep(0.5)
    passed = int(ask("time").split()[1]) - before
    check(f"time scale {scale}: idle time passes so fast", low <= passed <= high, passed)
    check(f"time scale {scale}: waiting costs nothing", used() - ticks <= 15, used() - ticks)
    card.send(frames[7])
    check(f"time scale {scale}: frames pass", receive() == frames[7].ljust(60, b"\0"))
    process.send_signal(signal.SIGTERM if scale else signal.SIGINT)
    process.communicate(timeout=10)
    check(f"time scale {scale}: a signal ends it cleanly", process.returncode == 0)

process, _ = begin("--stale-ms", "1")
for f in frames:
    card.send(f)
card.settimeout(1)
answered = [f for f in iter(receive, None)]
check("what is stale is dropped, the rest is answered in order", 0 < len(answered) < len(frames))
left = (f.ljust(60, b"\0") for f in frames)
check("in the order in which they came", all(f in left for f in answered))
card.send(frames[7])
check("what comes later is answered at once", receive() == frames[7].ljust(60, b"\0"))
process.send_signal(signal.SIGTERM)
err = process.communicate(timeout=10)[1]
check("the statistics tell what was stale", f"stale {len(frames) - len(answered)}," in err, err)

told("a second card is for a ring", "the network is no ring", "veth-slaves", "--ring-interface", "veth-end")
ip("link", "add", "veth-back", "type", "veth", "peer", "name", "veth-end")
for name in "veth-back", "veth-end":
    (pathlib.Path("/proc/sys/net/ipv6/conf") / name / "disable_ipv6").write_text("1")
    ip("link", "set", name, "up")
(OUT / "live.json").write_text(json.dumps({"slaves": line, "ring": True}))
told("a ring needs a second card", "--ring-interface is needed")
process, ready = begin("--ring-interface", "veth-end", "--time-scale", "0")
first, second = card, socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
second.bind(("veth-back", 0))
second.settimeout(5)
first.send(frames[8])
card = second
check("in a ring a frame comes to the other card", receive() == frames[8])
second.send(frames[9])
card = first
check("and the other way", receive() == frames[9])
process.send_signal(signal.SIGTERM)
process.communicate(timeout=10)
check("a ring ends cleanly", process.returncode == 0)

print(f"{len(failures)} failed" if failures else "all passed")
sys.exit(1 if failures else 0)
