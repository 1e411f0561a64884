"""Cuts a campaign into shards, and remembers those that are finished."""

import fcntl
import hashlib
import json
import os
from pathlib import Path

from campaign.shard import Refused, Shard, fits

# Sizes of a shard: so large that the start of its programs costs little, and so small that an interruption
# loses little and no worker is idle for long at the end.
SHARD_SIZES = {"fuzz": 20_000, "soak": 250_000, "faults": 20_000}


def share(total, count):
    """`total` in `count` shares that differ by one at most."""
    return [total // count + (i < total % count) for i in range(count)]


def plan(sets, totals, seed, sizes, finished=()):
    """The shards of each kind: `totals` of its unit over all sets of that kind, `sizes` of it in a shard.

    `sets`: name -> kind and hash, as `sets.json` has it. Every shard has a seed of its own, counted from
    `seed` on for each set: the model's state runs through all frames of a seed, so nothing begins in the
    middle of one. Shards of different sets take turns, so that every set is tried soon.

    A shard of `finished` is taken as it is, whatever its size, so that a campaign with more frames goes on
    behind one with fewer. The last one of a set may then be larger than what was left.
    """
    known = {(shard.kind, shard.set, shard.hash, shard.seed): shard for shard in finished}
    rounds = []
    for kind, size in sizes.items():
        names = [name for name in sets if sets[name]["kind"] == kind]
        for name, left in zip(names, share(totals[kind], len(names)) if names else []):
            turn, digest = 0, sets[name]["hash"]
            while left > 0:
                new = Shard(kind, name, seed + turn, min(left, size), digest)
                shard = known.get((kind, name, digest, new.seed), new)
                rounds.append((turn, shard))
                left -= shard.size
                turn += 1
    return [shard for _, shard in sorted(rounds, key=lambda r: r[0])]


def possible(shard):
    """Whether its fields are of the right types: a line of a file may hold anything."""
    texts, numbers = (shard.kind, shard.set, shard.hash), (shard.seed, shard.size)
    return all(type(t) is str for t in texts) and all(type(n) is int for n in numbers) and shard.size > 0


class Journal:
    """The finished shards of all campaigns with these sets and this first seed, one JSON line each.

    They are in a folder that no other campaign uses. Raises Refused if another process writes it, or if it
    cannot be read or written.
    """

    def __init__(self, root, sets, seed):
        names = sorted(f"{s['kind']} {name} {s['hash']}" for name, s in sets.items())
        digest = hashlib.sha256("\n".join([*names, str(seed)]).encode()).hexdigest()[:12]
        self.folder = Path(root) / digest
        self.path = self.folder / "shards.jsonl"
        self.results = {}  # Shard -> its result
        self.damaged = []  # numbers of lines that are no results
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.folder / "lock", "w")
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                self._read()
            except BaseException:
                self.close()
                raise
        except BlockingIOError:
            raise Refused(f"The campaign in {self.folder} is running already.") from None
        except OSError as problem:
            raise Refused(f"The campaign's folder cannot be used: {problem}.") from None

    def close(self):
        """Another process may write it now."""
        self._lock.close()

    def _read(self):
        if not self.path.exists():
            return
        # A line that an interruption cut short is a shard that is not finished; it must not spoil the next.
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if whole != text:
            os.truncate(self.path, len(whole))
        for number, line in enumerate(whole.split(b"\n")[:-1], 1):
            try:
                result = json.loads(line)
                shard = Shard(*(result[name] for name in ("kind", "set", "seed", "size", "hash")))
            except (ValueError, KeyError, TypeError):
                self.damaged.append(number)
                continue
            if possible(shard) and fits(shard, result):
                self.results[shard] = result
            else:
                self.damaged.append(number)

    def add(self, shard, result):
        """Counts only when it is on the disk. Raises Refused, and leaves no part, if it cannot be written."""
        line = json.dumps(result).encode() + b"\n"
        try:
            file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                end = os.fstat(file).st_size
                try:
                    if os.write(file, line) < len(line):
                        raise OSError(None, "the disk is full")
                    os.fsync(file)
                except OSError:
                    os.ftruncate(file, end)
                    raise
            finally:
                os.close(file)
        except OSError as problem:
            raise Refused(f"A result cannot be written to {self.path}: {problem.strerror}.") from None
        self.results[shard] = result
