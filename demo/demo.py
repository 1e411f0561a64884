#!/usr/bin/env python3
"""The smoke-alarm system at work: a simulated line of one master and five slaves, the server with its page,
and a panel at the terminal.

Usage: demo.py [--http-port 8080] [--slaves 5]. `make demo` builds what it needs and calls it. Ctrl-C ends
everything."""
import argparse
import json
import os
import pathlib
import secrets
import select
import signal
import socket
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDER = ROOT / "build" / "demo"
SIMULATOR = ROOT / "build" / "alarm" / "flyframe-alarm"

HELP = """\
  smoke 4 [off]             smoke at detector 4, or no more; the detector stays in alarm until it is
                            reset at the page
  line 2 open|short|whole   the two wires of detector 2
  cut 3, mend 3             the cable before slave 3
  restart 2, restart master takes the power away for some bus cycles; off 2, on 2: until it is back
  host 2 stop, host 2 start the program beside a slave's controller, or beside the master's
  press silence, press reset buttons of the master; also acknowledge and test
  status                    signals, the master's display, supplies, simulated time
  help, quit                Ctrl-C ends too
  Slaves are numbered from 1; the page calls them 1A, 1B, 2A, 2B, 3A."""


def make_key(path):
    """A key of this demonstration: readable for its owner only, never shown."""
    if path.exists():
        return
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(secrets.token_hex(16) + "\n")


def free_port(wanted):
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", wanted))
            return wanted
        except OSError:
            return 0


class Children:
    """The programs of the demonstration; all end together."""

    def __init__(self):
        self.all = []

    def start(self, name, *command):
        # A group of its own: Ctrl-C reaches this program only, which then ends the others in order.
        child = subprocess.Popen(
            [str(c) for c in command], stdout=subprocess.PIPE, text=True, cwd=ROOT, start_new_session=True
        )
        self.all.append((name, child))
        return child

    def ended(self):
        return next((name for name, child in self.all if child.poll() is not None), None)

    def stop(self):
        for _, child in reversed(self.all):
            if child.poll() is None:
                child.terminate()
        for _, child in reversed(self.all):
            try:
                child.wait(10)
            except subprocess.TimeoutExpired:
                child.kill()


def expect(name, child, beginnings):
    """What follows each of the beginnings in the lines the program prints at its start."""
    found = {}
    for line in child.stdout:
        for b in beginnings:
            if line.startswith(b):
                found[b] = line[len(b) :].strip()
        if len(found) == len(beginnings):
            return found
    sys.exit(f"The {name} did not start; see above.")


class Panel:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(path))
        self.answers = self.socket.makefile("r")

    def ask(self, line):
        self.socket.sendall((line + "\n").encode())
        return self.answers.readline().rstrip("\n")

    def take(self, line):
        """One line of the user; False: quit."""
        words = line.split()
        if not words:
            return True
        if words[0] in ("quit", "exit", "q"):
            return False
        if words[0] in ("help", "?", "h"):
            print(HELP)
            return True
        if words[0] == "smoke" and len(words) == 2:
            words.append("on")
        answer = self.ask(" ".join(words))
        if answer.startswith("ok {"):
            self.show(json.loads(answer[3:]))
        elif answer.startswith("error: "):
            print(answer[7:])
        else:
            print(answer[3:] or "ok")
        return True

    @staticmethod
    def show(status):
        def signals(node):
            lit = [n for n in ("buzzer", "lamp", "sounder", "fire", "fault", "disabled") if node.get(n)]
            return ", ".join(lit).upper() or "quiet"

        print(f"  simulated time {status['time_us'] / 1000:.1f} ms")
        print(f"  master    {signals(status['master'])}")
        for line in status["master"]["display"]:
            print(f"            | {line} |")
        for s in status["slaves"]:
            notes = [
                signals(s),
                "smoke" if s["smoke"] else "",
                "detector in alarm" if s["detector_alarm"] else "",
                "supply off" if not s["supply"] else "",
                f"line {s['line']}" if s["line"] != "whole" else "",
                "no power" if not s["powered"] else "",
                f"host {s['host']}" if s["host"] != "running" else "",
            ]
            cut = "-- cut -- " if s["cable"] == "cut" else ""
            print(f"  {cut}slave {s['slave']}   {', '.join(n for n in notes if n)}")


def serve(panel, children):
    open_input = sys.stdin is not None
    prompt = "> " if open_input and sys.stdin.isatty() else ""
    print(prompt, end="", flush=True)
    while True:
        ended = children.ended()
        if ended:
            sys.exit(f"The {ended} has ended; see above.")
        if not open_input:
            time.sleep(0.5)
            continue
        if not select.select([sys.stdin], [], [], 0.5)[0]:
            continue
        line = sys.stdin.readline()
        if not line:
            open_input = False  # no panel then: the system just runs
        elif not panel.take(line):
            return
        else:
            print(prompt, end="", flush=True)


def main():
    parser = argparse.ArgumentParser(description="The smoke-alarm system at work.")
    parser.add_argument(
        "--http-port", type=int, default=8080, help="port of the page (8080; another one if it is taken)"
    )
    parser.add_argument("--slaves", type=int, default=5, help="slaves on the line (5)")
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    key, control = FOLDER / "key", FOLDER / "control.sock"
    make_key(key)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    children = Children()
    try:
        server = children.start(
            "server", "java", "-cp", (FOLDER / "classpath").read_text().strip(), "flyframe.server.Server",
            "--http-port", free_port(options.http_port), "--udp-port", 0, "--database", FOLDER / "log.db",
            "--key", key, "--master-timeout-ms", 60000, "--order-timeout-ms", 120000,
        )  # fmt: skip
        told = expect("server", server, ["page: ", "reports: udp "])
        reports = told["reports: udp "].rsplit(":", 1)[1]
        line = children.start(
            "simulator", SIMULATOR, "--slaves", options.slaves, "--server-port", reports, "--key", key,
            "--state", FOLDER / "state", "--control", control,
        )  # fmt: skip
        expect("simulator", line, ["ready: "])
        print(f"page: {told['page: ']}")
        print(
            "The simulation is some hundred times slower than the real thing; "
            "'help' lists what the panel can do.",
            flush=True,
        )
        serve(Panel(control), children)
    except KeyboardInterrupt:
        print()
    finally:
        children.stop()


if __name__ == "__main__":
    main()
