#!/usr/bin/env python3
"""The smoke-alarm system at work: a simulated line of one master and five slaves, the server with its page,
and a panel at the terminal.

Usage: demo.py [--http-port 8080] [--slaves 5]. `make demo` builds what it needs and calls it. Ctrl-C ends
everything."""

import parts

FOLDER = parts.ROOT / "build" / "demo"
SIMULATOR = parts.ROOT / "build" / "alarm" / "flyframe-alarm"

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


def shorthand(words):
    return words + ["on"] if words[0] == "smoke" and len(words) == 2 else words


def greet(page):
    print(f"page: {page}")
    print(
        "The simulation is some hundred times slower than the real thing; "
        "'help' lists what the panel can do.",
        flush=True,
    )


def main():
    parser = parts.Arguments("The smoke-alarm system at work.", SIMULATOR)
    parser.add_argument("--slaves", type=parts.number(1, 64), default=5, metavar="N",
                        help="slaves on the line, 1 to 64 (5)")  # fmt: skip
    options = parser.parse_args()
    control = FOLDER / "control.sock"
    parts.run(
        FOLDER,
        options.http_port,
        lambda reports: (
            options.simulator, "--slaves", options.slaves, "--server-port", reports, "--key", FOLDER / "key",
            "--state", FOLDER / "state", "--control", control,
        ),  # fmt: skip
        greet,
        lambda: parts.Panel(control, HELP, show, shorthand),
    )


if __name__ == "__main__":
    main()
