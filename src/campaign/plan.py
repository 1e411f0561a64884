"""Cuts a campaign into shards, and remembers those that are finished."""

import fcntl
import hashlib
import json
import os
from pathlib import Path

from campaign.shard import Refused, Shard

# Sizes of a shard: so large that the start of its programs costs little, and so small that an interruption
# loses little and no worker is idle for long at the end.
SHARD_FRAMES = 20_000
SHARD_STEPS = 250_000


def cut(total, size):
    """`total` as pieces of `size`; what is left over is the last piece."""
    return [size] * (total // size) + ([total % size] if total % size else [])


def share(total, count):
    """`total` in `count` shares that differ by one at most."""
    return [total // count + (i < total % count) for i in range(count)]


def plan(sets, frames, steps, seed, shard_frames, shard_steps):
    """The shards of `frames` random frames over all sets of that kind, and of `steps` steps over all others.

    `sets`: name -> kind and hash, as `sets.json` has it. Every shard has a seed of its own, counted from `seed` on for
    each set: the model's state runs through all frames of a seed, so nothing begins in the middle of one. Shards of
    different sets take turns, so that every set is tried soon.
    """
    rounds = []
    for kind, total, size in (("fuzz", frames, shard_frames), ("soak", steps, shard_steps)):
        names = [name for name in sets if sets[name]["kind"] == kind]
        for name, mine in zip(names, share(total, len(names)) if names else []):
            for turn, piece in enumerate(cut(mine, size)):
                rounds.append((turn, Shard(kind, name, seed + turn, piece, sets[name]["hash"])))
    return [shard for _, shard in sorted(rounds, key=lambda r: r[0])]


class Journal:
    """The finished shards of a campaign, one JSON line each, in a folder that no other campaign uses.

    Raises Refused if another process writes it.
    """

    def __init__(self, root, shards):
        digest = hashlib.sha256("\n".join(s.key for s in shards).encode()).hexdigest()[:12]
        self.folder = Path(root) / digest
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock = open(self.folder / "lock", "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.close()
            raise Refused(f"The campaign in {self.folder} is running already.") from None
        self.path = self.folder / "shards.jsonl"
        keys = {shard.key for shard in shards}
        self.results = {key: result for key, result in self._read() if key in keys}

    def close(self):
        """Another process may write it now."""
        self._lock.close()

    def _read(self):
        if not self.path.exists():
            return
        # A line that an interruption cut short is a shard that is not finished; it must not spoil the next line.
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if whole != text:
            os.truncate(self.path, len(whole))
        for line in whole.splitlines():
            result = json.loads(line)
            yield Shard(*(result[name] for name in ("kind", "set", "seed", "size", "hash"))).key, result

    def add(self, shard, result):
        """Counts only when it is on the disk."""
        with open(self.path, "ab") as file:
            file.write(json.dumps(result).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        self.results[shard.key] = result
