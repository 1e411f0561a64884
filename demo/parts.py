"""What demonstrations have in common: their programs, the panel at the terminal, a key."""
import argparse
import json
import os
import pathlib
import re
import secrets
import select
import signal
import socket
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


class Arguments(argparse.ArgumentParser):
    """What all demonstrations can be told. Says in one sentence what is wrong."""

    def __init__(self, description, simulator):
        super().__init__(description=description)
        self.add_argument("--http-port", type=number(0, 65535), default=8080, metavar="PORT",
                          help="port of the page (8080; another one if it is taken)")  # fmt: skip
        self.add_argument("--simulator", default=simulator, help=argparse.SUPPRESS)  # of tests

    def error(self, message):
        self.exit(2, f"{self.prog}: {message} (see --help)\n")


def number(first, last):
    """The type of an argument: a whole number in these bounds."""

    def read(text):
        if not re.fullmatch("[0-9]{1,9}", text) or not first <= int(text) <= last:
            raise argparse.ArgumentTypeError(f"'{text}' is no whole number from {first} to {last}")
        return int(text)

    return read


def make_key(path):
    """A key of this demonstration: readable for its owner only, never shown."""
    if path.exists():
        return
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(secrets.token_hex(16) + "\n")


def bound(port):
    """A socket at a port of TCP, bound as servers do: one that old connections wait at is free."""
    probe = socket.socket()
    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        probe.bind(("127.0.0.1", port))
    except OSError:
        probe.close()
        raise
    return probe


def free_port(wanted):
    try:
        bound(wanted).close()
        return wanted
    except OSError:
        return 0


def door_port(wanted):
    """The wanted port, or one that is free now, for TCP and UDP."""
    for port in (wanted, *[0] * 10):
        try:
            with bound(port) as probe, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                other.bind(probe.getsockname())
                return probe.getsockname()[1]
        except OSError:
            continue
    raise OSError("no port is free for TCP and UDP")


class Children:
    """The programs of the demonstration; all end together."""

    def __init__(self):
        self.all = []

    def start(self, name, *command):
        # A group of its own: Ctrl-C reaches this program only, which then ends the others in order. The input
        # is never written to: it ends with this program, however that ends.
        child = subprocess.Popen(
            [str(c) for c in command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            start_new_session=True,
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
    """Takes lines of the user. `help_text`: what it can do; `show`: prints a status; `shorthand`: makes a
    line of the simulator's control socket of the user's words."""

    def __init__(self, path, help_text, show, shorthand):
        self.help_text, self.show, self.shorthand = help_text, show, shorthand
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(path))
        self.answers = self.socket.makefile("r")

    def ask(self, line):
        self.socket.sendall((line + "\n").encode())
        return self.answers.readline().rstrip("\n")

    def take(self, line):
        """One line of the user, in bytes; False: quit."""
        try:
            words = line.decode().split()
        except UnicodeDecodeError:
            print("That is no text in UTF-8; 'help' lists what the panel can do.")
            return True
        if not words:
            return True
        if words[0] in ("quit", "exit", "q"):
            return False
        if words[0] in ("help", "?", "h"):
            print(self.help_text)
            return True
        answer = self.ask(" ".join(self.shorthand(words)))
        if answer.startswith("ok {"):
            self.show(json.loads(answer[3:]))
        elif answer.startswith("error: "):
            print(answer[7:])
        else:
            print(answer[3:] or "ok")
        return True


def serve(panel, children):
    open_input = sys.stdin is not None
    prompt = "> " if open_input and sys.stdin.isatty() else ""
    print(prompt, end="", flush=True)
    unread = b""
    while True:
        ended = children.ended()
        if ended:
            sys.exit(f"The {ended} has ended; see above.")
        if not open_input:
            time.sleep(0.5)
            continue
        if not select.select([sys.stdin], [], [], 0.5)[0]:
            continue
        more = os.read(sys.stdin.fileno(), 4096)
        open_input = bool(more)  # else there is no panel any more: the system just runs
        *lines, unread = (unread + (more or b"\n")).split(b"\n")
        for line in lines:
            if not panel.take(line):
                return
            print(prompt, end="", flush=True)


def server_command(folder, http_port):
    """The server, on loopback, with its files in `folder`. It is patient, since simulated time is slow."""
    return (
        "java", "-cp", (folder / "classpath").read_text().strip(), "flyframe.server.Server",
        "--http-port", free_port(http_port), "--udp-port", 0, "--database", folder / "log.db",
        "--key", folder / "key", "--master-timeout-ms", 60000, "--order-timeout-ms", 120000, "--with-input",
    )  # fmt: skip


def end_on_signals():
    """Ctrl-C, the end of the terminal and SIGTERM end the demonstration, and its programs with it."""
    # nohup has one of them ignored.
    signals = [
        s for s in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM) if signal.getsignal(s) != signal.SIG_IGN
    ]

    def end(number, _):
        # Another one must not keep it from ending its programs.
        for s in signals:
            signal.signal(s, signal.SIG_IGN)
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(0)

    for s in signals:
        signal.signal(s, end)


def run(folder, http_port, simulator, greet, make_panel):
    """Starts the server and a simulator, and serves the panel until the user or a program ends.

    `simulator`: its command, made of the server's UDP port; `greet`: prints what the user should know, from
    the address of the page; `make_panel`: connects the panel."""
    folder.mkdir(parents=True, exist_ok=True)
    make_key(folder / "key")
    end_on_signals()
    children = Children()
    try:
        server = children.start("server", *server_command(folder, http_port))
        told = expect("server", server, ["page: ", "reports: udp "])
        reports = told["reports: udp "].rsplit(":", 1)[1]
        line = children.start("simulator", *simulator(reports), "--with-parent")
        expect("simulator", line, ["ready: "])
        greet(told["page: "])
        serve(make_panel(), children)
    except KeyboardInterrupt:
        print()
    finally:
        children.stop()
