"""One shard of a campaign: a run of one set from one seed on.

Needs only the standard library and the built programs.

As a program it runs one shard, which is what `make fuzz` and `make smsoak` do.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

PROGRAMS = "build/campaign/programs"
# Frames behind the one that differed: two frames can be on their way through the controller at the same time.
BEHIND = 8
# Frames of a shard from which on the code of Java's better compiler pays for its compilation.
SHORT = 10_000
# Whoever is killed without a chance to clean up leaves no program running.
TIED = ["setpriv", "--pdeathsig", "KILL", "--"]


# What the size of a shard counts, by its kind: random frames; steps of bus and host at the SyncManagers;
# cycles of a master whose cables fail.
UNITS = {"fuzz": "frames", "soak": "steps", "faults": "cycles"}


class Refused(Exception):
    """A shard cannot be run here; the message is a sentence that says why."""


@dataclass(frozen=True)
class Shard:
    kind: str  # a key of UNITS
    set: str
    seed: int
    size: int  # in that unit, all from `seed` on
    hash: str  # of the set's Verilog and of what the programs are made from

    @property
    def key(self):
        return f"{self.kind}-{self.set}-{self.seed}-{self.size}-{self.hash}"


def built(programs):
    """What `flyframe.campaign.Programs` built, as it wrote it into `sets.json`."""
    path = Path(programs) / "sets.json"
    try:
        document = json.loads(path.read_text())
        if isinstance(document["jars"], list) and isinstance(document["sets"], dict):
            return document
    except FileNotFoundError:
        raise Refused(f"No programs are built in {programs}; make campaign-programs builds them.") from None
    except (ValueError, KeyError, TypeError):
        pass
    raise Refused(f"{path} is damaged; make campaign-programs builds it anew.")


def built_sets(programs):
    """Name of a set that is built -> its kind and hash."""
    return built(programs)["sets"]


def check(shard, programs):
    """Raises Refused unless the programs here are those that the shard is for."""
    name = shard.set
    here = built_sets(programs).get(name)
    if here is None:
        raise Refused(
            f"The set {name} is not built in {programs}; make campaign-programs SETS={name} builds it."
        )
    if here["hash"] != shard.hash:
        raise Refused(
            f"The hash of set {shard.set} is {here['hash']} in {programs} but must be {shard.hash}."
        )


def writer(shard, programs):
    # Not all jars of the folder: one of an earlier build may lie there still, under another name.
    jars = os.pathsep.join(str(Path(programs) / "jars" / jar) for jar in built(programs)["jars"])
    # A collector of one thread: the player is busy beside it, and so are other shards.
    java = ["java", "-Xmx1g", "-XX:+UseSerialGC", "-cp", jars]
    # A short one is over before the better of Java's two compilers has paid.
    if shard.size < SHORT:
        java.append("-XX:TieredStopAtLevel=1")
    java.append("flyframe.campaign.Vectors")
    return [*java, "--set", shard.set, "--seed", str(shard.seed), "--frames", str(shard.size)]


def repeat(shard, text):
    """The command that repeats a finding: not further than the frame that differed."""
    if shard.kind == "soak":
        return f"make smsoak SET={shard.set} SEED={shard.seed} STEPS={shard.size}"
    if shard.kind == "faults":
        return f"make faults SEED={shard.seed} CYCLES={shard.size}"
    frame = re.search(r", frame (\d+):", text)
    size = min(shard.size, int(frame.group(1)) + 1 + BEHIND) if frame else shard.size
    return f"make fuzz PRESET={shard.set} SEED={shard.seed} FRAMES={size}"


def run_fuzz(shard, programs):
    # A session of its own: Ctrl-C is for the campaign, which ends its workers.
    write = subprocess.Popen(TIED + writer(shard, programs), stdout=subprocess.PIPE, start_new_session=True)
    play = subprocess.Popen(
        [*TIED, f"{programs}/flyframe-fuzz", "--preset", shard.set, "--vectors", "-"],
        stdin=write.stdout, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )
    write.stdout.close()
    try:
        text, _ = play.communicate()
        # A player that has stopped at a difference reads no further, which its writer does not notice. But a
        # writer that was killed leaves half a line, which can look like a difference.
        try:
            written = write.wait(None if play.returncode == 0 else 0.5)
        except subprocess.TimeoutExpired:
            written = 0
    finally:
        for process in (write, play):
            if process.poll() is None:
                process.kill()
                process.wait()
    if written != 0:
        raise RuntimeError(f"The writer of the vectors of {shard.key} ended with exit code {written}.")
    return play.returncode, text, r"^frames (\d+), .*"


def run_alone(program, unit):
    """Runs shards whose program makes its random numbers itself."""

    def run_it(shard, programs):
        numbers = [f"--{unit}", str(shard.size), "--seed", str(shard.seed)]
        done = subprocess.run(
            [*TIED, f"{programs}/{program}", "--preset", shard.set, *numbers],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )
        return done.returncode, done.stdout, rf"^{unit} (\d+) .*"

    return run_it


RUN = {
    "fuzz": run_fuzz,
    "soak": run_alone("flyframe-smsoak", "steps"),
    "faults": run_alone("flyframe-faults", "cycles"),
}


def run(shard, programs=PROGRAMS):
    """Runs a shard: its fields, what was done, seconds, the program's last line, and the finding or None."""
    check(shard, programs)
    start = time.monotonic()
    code, text, pattern = RUN[shard.kind](shard, programs)
    summary = re.search(pattern, text, re.MULTILINE)
    if code not in (0, 1) or not summary:
        raise RuntimeError(f"The program of {shard.key} ended with exit code {code}: {text.strip()[-500:]}")
    done = int(summary.group(1))
    if code == 0 and done < shard.size:
        raise RuntimeError(f"The program of {shard.key} ended after {done} of {shard.size}.")
    finding = {"text": text.strip(), "repeat": repeat(shard, text)} if code else None
    seconds = round(time.monotonic() - start, 2)
    return {**asdict(shard), "done": done, "seconds": seconds, "summary": summary.group(), "finding": finding}


def fits(shard, result):
    """Whether this can be the result of this shard: it comes from elsewhere, or from a file."""
    if not isinstance(result, dict) or any(result.get(k) != v for k, v in asdict(shard).items()):
        return False
    done, finding = result.get("done"), result.get("finding", "")
    if not isinstance(done, int) or not isinstance(result.get("seconds"), (int, float)):
        return False
    if finding is None:
        return done >= shard.size
    return isinstance(finding, dict) and all(isinstance(finding.get(k), str) for k in ("text", "repeat"))


def keep_vectors(shard, programs, text, path):
    """Writes the vectors of a finding up to the line that differed. The file appears when it is whole."""
    line = re.search(r"vector line (\d+)", text)
    path = Path(path)
    part = path.with_name(path.name + ".part")
    write = subprocess.Popen(TIED + writer(shard, programs), stdout=subprocess.PIPE, start_new_session=True)
    try:
        with open(part, "wb") as out:
            for number, content in enumerate(write.stdout, 1):
                if line and number > int(line.group(1)):
                    break
                out.write(content)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
        write.kill()
        write.stdout.close()
        write.wait()


def number(low, high=2**31 - 1):
    """A converter for argparse: a whole number in this range."""

    def convert(text):
        if not re.fullmatch(r"-?[0-9]{1,20}", text) or not low <= int(text) <= high:
            must = f"must be a whole number from {low} to {high}"
            raise argparse.ArgumentTypeError(f"is {text[:80]!r} but {must}")
        return int(text)

    return convert


class Parser(argparse.ArgumentParser):
    """An impossible argument ends the program with one sentence."""

    def error(self, message):
        print(f"{self.prog}: {message.rstrip('.')}.", file=sys.stderr)
        sys.exit(2)


def main(arguments=None):
    parser = Parser(prog="shard", description="Runs one set from one seed on.")
    parser.add_argument("programs", help="folder of the programs")
    parser.add_argument("set")
    parser.add_argument("seed", type=number(0, 2**63 - 1))
    parser.add_argument("size", type=number(1, 2**63 - 1), help="frames, steps or cycles")
    parser.add_argument("--vectors", metavar="FILE", help="where vectors that show a difference are kept")
    options = parser.parse_args(arguments)
    try:
        set_ = built_sets(options.programs).get(options.set)
        if set_ is None:
            raise Refused(f"The set {options.set} is not built in {options.programs}.")
        shard = Shard(set_["kind"], options.set, options.seed, options.size, set_["hash"])
        result = run(shard, options.programs)
        finding = result["finding"]
        if not finding:
            print(f"{options.set}, seed {options.seed}: {result['summary']}")
            return 0
        print(finding["text"])
        if options.vectors and shard.kind == "fuzz":
            keep_vectors(shard, options.programs, finding["text"], options.vectors)
            print(f"The vectors up to there are in {options.vectors}.")
        return 1
    except (Refused, RuntimeError, OSError) as problem:
        print(f"shard: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("shard: interrupted.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
