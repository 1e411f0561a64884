"""What campaigns have run on this machine, shard by shard: docs/campaigns.csv, and its page in docs/soak.md.

Takes the finished shards of build/campaign into the file, with the commit they ran on, and writes the section
of the page anew. A shard that is there already is not taken again, so that it may be called after each piece
of a long campaign.
"""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

from campaign.shard import UNITS, Refused

RECORD = Path("docs/campaigns.csv")
PAGE = Path("docs/soak.md")
HEADING = "## Campaigns"
KEY = ("kind", "set", "hash", "seed", "size")
FIELDS = (*KEY, "done", "frames", "seconds", "findings", "commit")


def recorded(path):
    """The runs in the file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return [{n: v if n in ("kind", "set", "hash", "commit") else float(v) for n, v in row.items()}
                for row in csv.DictReader(file)]


def finished(path):
    """The shards of a journal, as far as its lines are some."""
    for line in path.read_text().splitlines():
        try:
            result = json.loads(line)
            # Frames that it has sent: those of its summary, or its size, if that counts them.
            told = re.search(r"frames (\d+)", result["summary"] or "")
            of_unit = result["done"] if UNITS[result["kind"]] == "frames" else 0
            yield {
                **{name: result[name] for name in (*KEY, "done", "seconds")},
                "frames": int(told.group(1)) if told else of_unit,
                "findings": int(result["finding"] is not None),
            }
        except (ValueError, KeyError, TypeError):
            continue


def update(record, states, commit):
    """The runs of `record` and those of the journals `states` that it lacks, with `commit`."""
    runs = recorded(record)
    known = {tuple(run[name] for name in KEY) for run in runs}
    for path in states:
        for run in finished(path):
            if tuple(run[name] for name in KEY) not in known:
                known.add(tuple(run[name] for name in KEY))
                runs.append({**run, "commit": commit})
    return runs


def write(record, runs):
    with record.open("w", newline="") as file:
        rows = csv.DictWriter(file, FIELDS, lineterminator="\n")
        rows.writeheader()
        rows.writerows({n: f"{v:g}" if n == "seconds" else int(v) if isinstance(v, float) else v
                        for n, v in run.items()} for run in runs)


def hours(seconds):
    return f"{seconds / 3600:.1f}"


def section(runs):
    """The part of the page: a row per set and commit, and the sum of each kind."""
    rows = {}
    for run in runs:
        rows.setdefault((run["kind"], run["set"], run["commit"]), []).append(run)
    text = [
        HEADING,
        "",
        "Pieces of campaigns ([how they run](campaign.md)), added up by `make campaign-record` from",
        "[the list of their shards](campaigns.csv).",
        "",
        "| Set | Sources | Shards | Counted in | Amount | Frames | Hours of a core | Findings |",
        "| --- | --- | ---: | --- | ---: | ---: | ---: | ---: |",
    ]

    def row(name, commit, kind, group):
        amount, sent, findings = (int(sum(r[n] for r in group)) for n in ("done", "frames", "findings"))
        text.append(
            f"| {name} | {commit} | {len(group)} | {UNITS[kind]} | {amount:,} | {sent:,} "
            f"| {hours(sum(r['seconds'] for r in group))} | {findings} |"
        )

    for (kind, name, commit), group in sorted(rows.items()):
        row(name, commit, kind, group)
    for kind in sorted({run["kind"] for run in runs}):
        row("**all**", "", kind, [run for run in runs if run["kind"] == kind])
    return "\n".join(text) + "\n"


def in_page(page, part):
    """`page` with `part` in place of the section it had."""
    return page.split(HEADING)[0].rstrip("\n") + "\n\n" + part


def main():
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=True
    ).stdout.strip()
    runs = update(RECORD, sorted(Path("build/campaign").glob("*/shards.jsonl")), commit)
    if not runs:
        raise Refused("No shard of a campaign has been finished in build/campaign.")
    write(RECORD, runs)
    PAGE.write_text(in_page(PAGE.read_text(), section(runs)))
    print(f"{RECORD} has {len(runs)} shards; {PAGE} is written.")


if __name__ == "__main__":
    try:
        main()
    except Refused as problem:
        sys.exit(f"campaign-record: {problem}")
