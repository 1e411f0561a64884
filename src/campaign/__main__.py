"""Command line of a campaign (docs/campaign.md).

Exit code 0: all shards ran and nothing differed; 1: there are findings; 2: an impossible argument, or shards
that could not be run; 130: interrupted, to be resumed by the same command.
"""

import os
import re
import signal
import sys
import time
from argparse import ArgumentTypeError
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from pathlib import Path

from campaign import programs as programs_module
from campaign.plan import SHARD_SIZES, Journal, plan
from campaign.shard import PROGRAMS, UNITS, Parser, Refused, built_sets, keep_vectors, number


def names(text):
    found = text.split()
    bad = [name for name in found if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name)]
    if bad or not found:
        raise ArgumentTypeError(f"is {text!r} but must be names of sets with spaces between them")
    return found


def address(text):
    found = re.fullmatch(r"(tcp|tls)://[^/\s:]+:([0-9]{1,5})", text)
    if text and not (found and 0 < int(found.group(2)) < 2**16):
        raise ArgumentTypeError(f"is {text!r} but must be like tcp://host:8786")
    return text


def parse(arguments):
    # What a user of make may set has its default in the Makefile.
    text = "Random frames and other long runs in shards, on the workers of Dask."
    parser = Parser(prog="campaign", description=text)
    kinds = ", ".join(UNITS)
    parser.add_argument("--sets", type=names, required=True, help=f"names of sets; {kinds}: all of a kind")
    parser.add_argument("--frames", type=number(1), required=True, help="random frames of all sets together")
    parser.add_argument("--steps", type=number(1), required=True, help="steps of the soak sets together")
    parser.add_argument("--cycles", type=number(1), required=True, help="cycles of the faults sets together")
    parser.add_argument("--seed", type=number(0), required=True, help="of each set's first shard")
    for kind, unit in UNITS.items():
        size = SHARD_SIZES[kind]
        parser.add_argument(f"--shard-{unit}", type=number(1), default=size, metavar=unit.upper())
    parser.add_argument(
        "--scheduler", type=address, default="", help="tcp://host:port; default: this machine alone"
    )
    parser.add_argument("--workers", type=number(1), help="of this machine; default: one per core")
    parser.add_argument(
        "--patience", type=number(0), metavar="SECONDS", help="how long to wait if no worker is willing"
    )
    parser.add_argument(
        "--programs", default=PROGRAMS, help="where the programs are built, here and on each worker"
    )
    parser.add_argument("--build", metavar="COMMAND", help="builds the programs first")
    parser.add_argument("--state", default="build/campaign", help="where finished shards are remembered")
    options = parser.parse_args(arguments)
    if options.scheduler and options.workers:
        parser.error("--workers is for this machine alone; the scheduler has workers of its own")
    return options


def chosen(wanted, built):
    """The sets asked for, in the order asked."""
    sets = {}
    for name in wanted:
        found = {n: s for n, s in built.items() if n == name or s["kind"] == name}
        if not found:
            raise Refused(f"The set {name} is not built; built are {', '.join(sorted(built))}.")
        sets.update(found)
    return sets


class Interrupts:
    """Ctrl-C and SIGTERM: the first ends the campaign in order, a second one at once."""

    def __init__(self):
        self.came, self.shielded = 0, False
        for number_ in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number_, self)

    def __call__(self, number_, frame):
        self.came += 1
        if self.came > 1:
            # Nothing is lost: a result that counts is on the disk. Workers and their programs end, too.
            os._exit(130)
        if not self.shielded:
            raise KeyboardInterrupt

    def check(self):
        """Ends what goes on although one came: Python drops an exception that is raised in a destructor."""
        if self.came:
            raise KeyboardInterrupt

    @contextmanager
    def shield(self):
        """What begins here is not interrupted half-way, and its threads and processes never by Ctrl-C.

        A terminal sends Ctrl-C to every process; the campaign alone acts on it, and ends its workers.
        """
        resource_tracker.ensure_running()  # which would unblock it in the thread that starts processes
        self.shielded = True
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            self.shielded = False
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            self.check()


def warn(sentence):
    print(f"campaign: {sentence}", file=sys.stderr, flush=True)


class Campaign:
    """From the plan to the report. `folder`: the programs, which nobody changes meanwhile."""

    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.sets = chosen(options.sets, built_sets(folder))
        self.journal = Journal(options.state, self.sets, options.seed)
        totals = {kind: getattr(options, unit) for kind, unit in UNITS.items()}
        sizes = {kind: getattr(options, f"shard_{unit}") for kind, unit in UNITS.items()}
        self.shards = plan(self.sets, totals, options.seed, sizes, self.journal.results)
        self.todo = [shard for shard in self.shards if shard not in self.journal.results]
        self.ran = []
        self.bar = None

    @property
    def results(self):
        """Of the shards of this plan; the journal may hold more."""
        return {s: self.journal.results[s] for s in self.shards if s in self.journal.results}

    def resumable(self):
        return f"the same command goes on behind {len(self.results)} of {len(self.shards)} shards."

    def begin(self):
        """Says what there is to do, and what was found before."""
        for line in self.journal.damaged:
            warn(f"line {line} of {self.journal.path} is no result and is passed over.")
        without = sorted(set(self.sets) - {shard.set for shard in self.shards})
        if without:
            fewer = "as there are fewer frames, steps or cycles than sets"
            warn(f"sets without a shard, {fewer}: {', '.join(without)}.")
        finished = len(self.shards) - len(self.todo)
        print(f"campaign {self.journal.folder}: {len(self.shards)} shards, of which {finished} are finished")
        for shard, result in self.results.items():
            if result["finding"]:
                print(self.tell(shard, result))
        sys.stdout.flush()

    def tell(self, shard, result):
        """A finding as it is reported: set, seed, range, what differed, the command that repeats it."""
        unit = UNITS[shard.kind]
        text = result["finding"]["text"]
        lines = [f"FINDING in {shard.set}, seed {shard.seed}, {unit} 1 to {shard.size}:"]
        lines += [line[:500] for line in text.splitlines()]
        where = f" PROGRAMS={self.options.programs}" if self.options.programs != PROGRAMS else ""
        lines.append(f"repeat: {result['finding']['repeat']}{where}")
        if shard.kind == "fuzz" and not self.options.scheduler:
            vectors = Path(self.journal.folder) / f"{shard.set}-{shard.seed}.vectors"
            try:
                if not vectors.exists():
                    keep_vectors(shard, self.folder, text, vectors)
                lines.append(f"vectors: {vectors}")
            except OSError as problem:
                lines.append(f"vectors: not kept: {problem}")
        return "\n".join(lines)

    def done(self, shard, result):
        self.journal.add(shard, result)
        self.ran.append(result)
        self.bar.update()
        self.bar.set_postfix_str(f"{self.speed():,.0f}/s")
        if result["finding"]:
            self.bar.write(self.tell(shard, result))

    def speed(self):
        return sum(r["done"] for r in self.ran) / max(time.monotonic() - self.began, 1e-3)

    def run(self, interrupts):
        """Runs what is left; sentences about what could not be run."""
        self.began = time.monotonic()
        if not self.todo:
            return []
        # Only here, as these take a while to load.
        from tqdm import tqdm
        from campaign import runner as dask_runner

        options = self.options
        patience = dask_runner.PATIENCE if options.patience is None else options.patience
        with ExitStack() as stack:
            cluster = None
            with interrupts.shield():
                if not options.scheduler:
                    count = options.workers or dask_runner.default_workers()
                    scratch = self.journal.folder / "dask"
                    cluster = stack.enter_context(dask_runner.local_cluster(count, scratch))
                try:
                    client = dask_runner.connect(options.scheduler, cluster)
                except (OSError, ValueError):
                    raise Refused(f"No scheduler answers at {options.scheduler}.") from None
                stack.callback(dask_runner.close, client)
            total, finished = len(self.shards), len(self.shards) - len(self.todo)
            self.bar = stack.enter_context(tqdm(total=total, initial=finished, unit="shard", smoothing=0.05))
            runner = dask_runner.Runner(client, options.programs, self.folder.name, patience)
            runner.run(self.todo, self.done, self.bar.write, interrupts.check)
            return runner.failures

    def report(self, failures):
        from campaign.runner import summary

        results = self.results.values()
        for line in summary(results):
            print(line)
        findings = [result for result in results if result["finding"]]
        print(
            f"{len(results)} of {len(self.shards)} shards finished, {len(findings)} findings; "
            f"this run: {len(self.ran)} shards, {time.monotonic() - self.began:.0f} s, "
            f"{self.speed():,.0f} frames, steps or cycles/s",
            flush=True,
        )
        for failure in failures:
            warn(f"not run: {failure}")
        return 1 if findings else 2 if failures else 0


def main(arguments=None):
    options = parse(arguments)
    interrupts = Interrupts()
    campaign = None
    try:
        with programs_module.kept(options.programs, options.build, warn) as folder:
            campaign = Campaign(options, folder)
            campaign.begin()
            return campaign.report(campaign.run(interrupts))
    except KeyboardInterrupt:
        warn(f"interrupted; {campaign.resumable()}" if campaign else "interrupted before it began.")
        return 130
    except (Refused, OSError) as problem:
        sentence = str(problem).rstrip(".")
        warn(f"{sentence}; {campaign.resumable()}" if campaign and campaign.ran else f"{sentence}.")
        return 2


if __name__ == "__main__":
    code = main()
    # Python takes its handlers back while it ends: what comes now would change the exit code.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.exit(code)
