"""Command line of a campaign (docs/campaign.md).

Exit code 0: all shards ran and nothing differed; 1: there are findings; 2: an impossible argument, or shards that could
not be run; 130: interrupted, to be resumed by the same command.
"""

import argparse
import re
import signal
import sys
import time
from pathlib import Path

from campaign.plan import SHARD_FRAMES, SHARD_STEPS, Journal, plan
from campaign.shard import PROGRAMS, Refused, built_sets, keep_vectors


class Parser(argparse.ArgumentParser):
    def error(self, message):
        print(f"campaign: {message.rstrip('.')}.", file=sys.stderr)
        sys.exit(2)


def number(low):
    def convert(text):
        if not re.fullmatch(r"-?\d+", text) or not low <= int(text) <= 2**31 - 1:
            raise argparse.ArgumentTypeError(f"is {text!r} but must be a whole number from {low} to {2**31 - 1}")
        return int(text)

    return convert


def names(text):
    found = text.split()
    bad = [name for name in found if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name)]
    if bad or not found:
        raise argparse.ArgumentTypeError(f"is {text!r} but must be names of sets with spaces between them")
    return found


def address(text):
    if text and not re.fullmatch(r"(tcp|tls)://[^/\s:]+:\d+", text):
        raise argparse.ArgumentTypeError(f"is {text!r} but must be like tcp://host:8786")
    return text


def parse(arguments):
    # What a user of make may set has its default in the Makefile.
    parser = Parser(prog="campaign", description="Random frames and soak runs in shards, on the workers of Dask.")
    parser.add_argument("--sets", type=names, required=True, help="names of sets; fuzz, soak: all of a kind")
    parser.add_argument("--frames", type=number(1), required=True, help="random frames of all sets together")
    parser.add_argument("--steps", type=number(1), required=True, help="steps of the soak sets together")
    parser.add_argument("--seed", type=number(0), required=True, help="of each set's first shard")
    parser.add_argument("--shard-frames", type=number(1), default=SHARD_FRAMES, metavar="FRAMES")
    parser.add_argument("--shard-steps", type=number(1), default=SHARD_STEPS, metavar="STEPS")
    parser.add_argument("--scheduler", type=address, default="", help="tcp://host:port; default: this machine alone")
    parser.add_argument("--workers", type=number(1), help="of this machine; default: one per core")
    parser.add_argument(
        "--patience", type=number(0), metavar="SECONDS", help="how long to wait if every worker refuses"
    )
    parser.add_argument("--programs", default=PROGRAMS, help="where the programs are built, here and on each worker")
    parser.add_argument("--state", default="build/campaign", help="where finished shards are remembered")
    parser.add_argument("--check", action="store_true", help="only check the arguments")
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


def tell(shard, result, options, folder):
    """A finding as it is reported: set, seed, range, what differed, the command that repeats it."""
    unit = "frames" if shard.kind == "fuzz" else "steps"
    text = result["finding"]["text"]
    lines = [f"FINDING in {shard.set}, seed {shard.seed}, {unit} 1 to {shard.size}:", *(t[:500] for t in text.splitlines())]
    where = f" PROGRAMS={options.programs}" if options.programs != PROGRAMS else ""
    lines.append(f"repeat: {result['finding']['repeat']}{where}")
    if shard.kind == "fuzz" and not options.scheduler:
        vectors = Path(folder) / f"{shard.set}-{shard.seed}.vectors"
        if not vectors.exists():
            keep_vectors(shard, options.programs, text, vectors)
        lines.append(f"vectors: {vectors}")
    return "\n".join(lines)


def main(arguments=None):
    options = parse(arguments)
    if options.check:
        return 0
    # Only here, as the arguments are checked without Dask.
    from tqdm import tqdm
    from campaign import runner as dask_runner

    try:
        sets = chosen(options.sets, built_sets(options.programs))
        shards = plan(sets, options.frames, options.steps, options.seed, options.shard_frames, options.shard_steps)
        journal = Journal(options.state, shards)
    except Refused as refusal:
        print(f"campaign: {refusal}", file=sys.stderr)
        return 2
    todo = [shard for shard in shards if shard.key not in journal.results]
    print(f"campaign {journal.folder}: {len(shards)} shards, of which {len(shards) - len(todo)} are finished", flush=True)
    for shard in shards:
        if shard.key in journal.results and journal.results[shard.key]["finding"]:
            print(tell(shard, journal.results[shard.key], options, journal.folder))

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as cleanly as Ctrl-C
    began, ran, failures = time.monotonic(), [], []
    if todo:
        cluster = client = None
        bar = None
        try:
            if not options.scheduler:
                cluster = dask_runner.local_cluster(options.workers or dask_runner.default_workers(), journal.folder / "dask")
            try:
                client = dask_runner.connect(options.scheduler, cluster)
            except OSError:
                print(f"campaign: no scheduler answers at {options.scheduler}.", file=sys.stderr)
                return 2
            bar = tqdm(total=len(shards), initial=len(shards) - len(todo), unit="shard", smoothing=0.05)

            def done(shard, result):
                journal.add(shard, result)
                ran.append(result)
                bar.update()
                bar.set_postfix_str(f"{sum(r['done'] for r in ran) / (time.monotonic() - began):,.0f}/s")
                if result["finding"]:
                    bar.write(tell(shard, result, options, journal.folder))

            patience = dask_runner.PATIENCE if options.patience is None else options.patience
            runner = dask_runner.Runner(client, options.programs, patience)
            runner.run(todo, done, bar.write)
            failures = runner.failures
        except KeyboardInterrupt:
            if bar:
                bar.close()
            print(f"campaign: interrupted; the same command goes on behind {len(journal.results)} of {len(shards)} shards.",
                  file=sys.stderr)
            return 130
        finally:
            if bar:
                bar.close()
            for part in (client, cluster):
                if part:
                    part.close()

    for line in dask_runner.summary(journal.results.values()):
        print(line)
    findings = [result for result in journal.results.values() if result["finding"]]
    seconds = time.monotonic() - began
    print(f"{len(journal.results)} of {len(shards)} shards finished, {len(findings)} findings; this run: {len(ran)} shards, "
          f"{seconds:.0f} s, {sum(r['done'] for r in ran) / seconds:,.0f} frames or steps/s")
    for failure in failures:
        print(f"campaign: not run: {failure}", file=sys.stderr)
    return 1 if findings else 2 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
