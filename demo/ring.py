#!/usr/bin/env python3
"""The fibre ring at work: twelve simulated nodes in RTL with their host programs, the first of them the
gateway to the server with its page, CAN programs at the last, and a panel at the terminal.

Usage: ring.py [--http-port 8080] [--nodes 12]. `make demo-ring` builds what it needs and calls it. Ctrl-C
ends everything."""
import json

import parts

FOLDER = parts.ROOT / "build" / "demo-ring"
SIMULATOR = parts.ROOT / "build" / "ring" / "flyframe-ring"

HELP = """\
  cut 3 [there|back]        both fibres between node 3 and the next, or one of them; mend 3
  kill 5, revive 5          takes the power of node 5 away, and gives it back
  disturb 4 [1000], calm 4  one bit of so many is wrong on the fibres behind node 4; no more
  send 2 hello, urgent 2 hello  a message of node 2 to the server
  host 1 stop, host 1 start the program beside a node's controller, also beside the gateway's
  status                    nodes, ports, fibres, simulated time
  help, quit                Ctrl-C ends too
  All else that flyframe-ring takes (src/sim/README.md): reset 4, optics 2 jitter 2, ..."""


def shorthand(words):
    verb, rest = words[0], words[1:]
    if verb == "kill":
        return ["off", *rest]
    if verb == "revive":
        return ["on", *rest]
    if verb == "disturb":
        return ["optics", *rest[:1], "errors", *(rest[1:] or ["1000"])]
    if verb == "calm":
        return ["optics", *rest[:1], "errors", "0"]
    if verb in ("send", "urgent") and len(rest) >= 2:
        return [verb, rest[0], "1", " ".join(rest[1:]).encode().hex()]
    return words


def show(status):
    if "nodes" not in status:
        print(json.dumps(status))
        return
    print(f"  simulated time {status['time_us'] / 1000:.1f} ms")
    fibres = {f["fibre"]: f for f in status["fibres"]}
    for n in status["nodes"]:
        notes = [] if n["powered"] else ["no power"]
        if "ports" in n:  # what its program has seen
            notes += [f"port {p} {'up' if n['ports'] & bit else 'DOWN'}" for p, bit in ((1, 0x04), (2, 0x40))]
        if not n["runs"]:
            notes.append("no host program")
        print(f"  node {n['node']:<2} {n['host']:<6} {', '.join(notes)}")
        fibre = fibres.get(n["node"])
        if fibre and not (fibre["there"]["whole"] and fibre["back"]["whole"]):
            cut = [way for way in ("there", "back") if not fibre[way]["whole"]]
            print(f"     -- cut {' and '.join(cut)} --")


def main():
    parser = parts.Arguments("The fibre ring at work.", SIMULATOR)
    parser.add_argument("--nodes", type=parts.number(3, 32), default=12, metavar="N",
                        help="nodes, 3 to 32 (12)")  # fmt: skip
    options = parser.parse_args()
    last = options.nodes
    FOLDER.mkdir(parents=True, exist_ok=True)
    nodes = [{"preset": "ring-server", "host": "server"}] + [{} for _ in range(last - 2)] + [{"host": "can"}]
    # Simulated time is slow: what takes seconds on boards takes milliseconds here.
    network = {"nodes": nodes, "hello_ms": 10, "up_ms": 1, "confirm_us": 2000, "each": {"fibre_km": 1}}
    (FOLDER / "network.json").write_text(json.dumps(network))
    control, slcan = FOLDER / "control.sock", FOLDER / "slcan"
    socketcand, cannelloni = parts.door_port(29536), parts.door_port(20000)
    pcap, log, plant = FOLDER / "ring.pcap", FOLDER / "ring.log", FOLDER / "plant.pcap"
    doors = [
        (f"--slcan={last}={slcan}", f"slcan on {slcan}: python-can, interface slcan"),
        (f"--socketcand={last}={socketcand}", f"socketcand on 127.0.0.1:{socketcand}, bus can0"),
        (f"--cannelloni={last}={cannelloni}", f"cannelloni on 127.0.0.1:{cannelloni}, TCP and UDP"),
        (f"--record={last}={pcap}", f"frames in {pcap}, for Wireshark"),
        (f"--candump={last}={log}", f"the same as a log of candump: {log}"),
        (f"--plant-pcap={plant}", f"datagrams with the server in {plant}"),
    ]

    def greet(page):
        print(f"page: {page}")
        print(f"Nodes 1 to {last}, the first one is the gateway. CAN programs join the ring as node {last}:")
        for _, text in doors:
            print(f"  {text}")
        print(
            "The simulation is some hundred times slower than the real thing. Try: cut 3. "
            "'help' lists what the panel can do.",
            flush=True,
        )

    parts.run(
        FOLDER,
        options.http_port,
        lambda reports: (
            options.simulator, "--network", FOLDER / "network.json", "--server-port", reports,
            "--key", FOLDER / "key", "--state", FOLDER / "state", "--control", control,
            *[option for option, _ in doors],
        ),  # fmt: skip
        greet,
        lambda: parts.Panel(control, HELP, show, shorthand),
    )


if __name__ == "__main__":
    main()
