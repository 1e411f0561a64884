"""Runs shards on the workers of a Dask scheduler.

The campaign itself gives each worker as many shards as it has threads, and the next when one has ended. So it
knows which worker had which shard, and no shard goes to a worker that would refuse it.
"""

import asyncio
import concurrent.futures
import logging
import os
import queue
import time
from collections import Counter
from dataclasses import dataclass, field

import dask
from dask.distributed import Client, LocalCluster
from distributed.scheduler import KilledWorker

from campaign import programs as programs_module
from campaign import shard as shards_module

# A shard that has cost so many workers their lives is given up.
LIVES = 3
# A shard that fails is tried so often, on different workers if there are any.
TRIES = 2
# After so many failures in succession a worker pauses.
FAULTS = 3
# So many seconds a campaign waits for a worker that does not refuse, when it has nothing else to do.
PATIENCE = 60
# After so many seconds of that it says so.
NOTICE = 5
# Seconds until a worker that refuses is asked again; they double each time.
FIRST_PAUSE, LONGEST_PAUSE = 2, 10
# A worker that fails pauses longer in the end than any campaign waits for it.
LONGEST_FAULT = 2 * PATIENCE
# Seconds between two looks at which workers there are.
LOOK = 1
# Seconds until a result that a worker has announced must have arrived.
FETCH = 20


def probe(wanted, programs):
    """Runs on a worker: set -> the sentence with which it refuses shards of it. `wanted`: set -> hash."""
    refused = {}
    for name, digest in wanted.items():
        try:
            programs_module.find(programs, name, digest)
        except shards_module.Refused as refusal:
            refused[name] = str(refusal)
    return refused


def work(shard, kept, programs):
    """Runs on a worker: the result, or the sentence with which it refuses the shard.

    `kept`: name of the campaign's own folder of kept programs. A worker elsewhere may have others of the same
    hash, built by another compiler.
    """
    try:
        with programs_module.using(programs, shard.set, shard.hash, kept) as folder:
            return shards_module.run(shard, folder), None
    except shards_module.Refused as refusal:
        return None, str(refusal)


def local_cluster(workers, scratch):
    """A cluster of processes of this machine that nobody else can reach."""
    dask.config.set({"distributed.scheduler.allowed-failures": LIVES})
    return LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
        dashboard_address="127.0.0.1:0", worker_dashboard_address=None, local_directory=str(scratch),
        silence_logs=50,
    )


def connect(scheduler=None, cluster=None):
    """A client of the scheduler at this address, or of this machine's cluster. OSError if none answers."""
    logging.disable(logging.CRITICAL)  # what matters is said in sentences of our own
    address = scheduler or cluster.scheduler_address
    return Client(address, timeout="10s", set_as_default=False)


def close(client):
    try:
        client.close(timeout=5)
    except Exception:  # the scheduler has gone
        pass


def one_line(problem):
    text = " ".join(str(problem).split())
    return (text or type(problem).__name__)[:500].rstrip(".")


@dataclass
class Worker:
    slots: int
    running: int = 0
    answered: bool = False  # has it ever said what it refuses?
    asked: bool = False  # is a question on its way?
    ask_at: float = 0.0  # when to ask the next time, unless it refuses nothing
    pause: float = FIRST_PAUSE
    refuses: dict | None = None  # set -> sentence; None: it gets nothing
    faults: int = 0  # failures in succession
    excluded: bool = False  # for the rest of the campaign

    def willing(self, shard):
        return self.refuses is not None and not self.excluded and shard.set not in self.refuses

    def may_take(self, shard):
        """Who has not said yet what it refuses may be willing."""
        return self.willing(shard) or not (self.answered or self.excluded)

    def rest(self, longest=LONGEST_PAUSE):
        self.ask_at = time.monotonic() + self.pause
        self.pause = min(2 * self.pause, longest)


@dataclass
class Task:
    """A shard on a worker, or a question to it if there is no shard."""

    address: str
    shard: object = None


@dataclass
class Troubles:
    """What a shard has caused so far."""

    deaths: int = 0
    failed_on: list = field(default_factory=list)  # addresses of workers


class Runner:
    def __init__(self, client, programs, kept, patience=PATIENCE):
        self.client, self.programs, self.kept, self.patience = client, programs, kept, patience
        self.failures = []  # sentences about shards that could not be run
        self.workers = {}  # address -> Worker
        self.tasks = {}  # future -> Task
        self.troubles = {}  # Shard -> Troubles
        self.said = set()
        self.last_refusal = ""

    def run(self, shards, done, say, check=lambda: None):
        """Calls `done(shard, result)` as shards end, in any order; `say(sentence)` when a worker refuses.

        `check()` is called often and may end the run by an exception.

        Raises Refused if the scheduler goes away.
        """
        self.waiting, self.done, self.say = list(shards), done, say
        self.wanted = {shard.set: shard.hash for shard in shards}
        self.ended = queue.SimpleQueue()
        looked, hopeful, noticed = -LOOK, time.monotonic(), False
        try:
            while self.waiting or any(task.shard for task in self.tasks.values()):
                check()
                now = time.monotonic()
                if now >= looked + LOOK:
                    self._look()
                    looked = now
                self._ask(now)
                self._assign()
                runs = any(task.shard for task in self.tasks.values())
                if runs or any(not worker.answered for worker in self.workers.values()):
                    hopeful, noticed = now, False
                elif now - hopeful >= self.patience:
                    self.failures.append(self._nobody())
                    return
                elif now - hopeful >= NOTICE and not noticed:
                    noticed = True
                    self.say(f"{self._nobody()} It waits {self.patience - NOTICE} s more.")
                self._take()
        finally:
            self._cancel(list(self.tasks))

    def _cancel(self, futures):
        if futures and self.client.status == "running":
            try:
                self.client.cancel(futures, force=True)
            except Exception:  # the scheduler has gone, and they with it
                pass

    def _nobody(self):
        sets = sorted({shard.set for shard in self.waiting})
        named = ", ".join(sets[:5]) + (f" and {len(sets) - 5} more" if len(sets) > 5 else "")
        why = f"; the last refusal: {self.last_refusal}" if self.last_refusal else "."
        count = f"{len(self.waiting)} shard{'s' * (len(self.waiting) != 1)} of {named}"
        return f"{count}: no worker is willing{why}" if self.workers else f"{count}: there is no worker."

    def _look(self):
        """Which workers are there? Shards of those that have gone are for others."""
        info = self.client.scheduler_info(n_workers=-1)["workers"]
        if self.client.status != "running":
            raise shards_module.Refused("The scheduler is gone.")
        for address in set(self.workers) - set(info):
            del self.workers[address]
        for address, about in info.items():
            self.workers.setdefault(address, Worker(max(1, about["nthreads"])))
        gone = [future for future, task in self.tasks.items() if task.address not in self.workers]
        for future in gone:
            shard = self.tasks.pop(future).shard
            if shard:
                self._died(shard)
        self._cancel(gone)

    def _submit(self, task, function, *arguments, priority=0):
        future = self.client.submit(
            function, *arguments, self.programs, pure=False, workers=[task.address],
            allow_other_workers=False, priority=priority,
        )
        self.tasks[future] = task
        future.add_done_callback(self.ended.put)

    def _ask(self, now):
        for address, worker in self.workers.items():
            settled = worker.refuses == {} or worker.excluded
            if not worker.asked and not settled and now >= worker.ask_at:
                worker.asked = True
                self._submit(Task(address), probe, self.wanted, priority=10)

    def _assign(self):
        for address, worker in self.workers.items():
            while worker.running < worker.slots:
                place = self._next_for(address, worker)
                if place is None:
                    break
                worker.running += 1
                shard = self.waiting.pop(place)
                self._submit(Task(address, shard), work, shard, self.kept)

    def _next_for(self, address, worker):
        """The place of the first shard for this worker; one that failed there if no other may take it."""
        for place, shard in enumerate(self.waiting):
            if not worker.willing(shard):
                continue
            failed_on = self.troubles[shard].failed_on if shard in self.troubles else []
            if address not in failed_on or not any(
                other.may_take(shard) for name, other in self.workers.items() if name not in failed_on
            ):
                return place
        return None

    def _take(self):
        """Takes an answer, for which it does not wait long."""
        try:
            future = self.ended.get(timeout=LOOK if self.tasks else LOOK / 5)
        except queue.Empty:
            return
        task = self.tasks.pop(future, None)
        if task is None:  # of a worker that has gone
            return
        worker = self.workers[task.address]
        if task.shard:
            worker.running -= 1
        else:
            worker.asked = False
        try:
            answer = future.result(timeout=FETCH)
        except (asyncio.CancelledError, concurrent.futures.CancelledError):
            raise shards_module.Refused("The scheduler is gone.") from None
        except (KilledWorker, TimeoutError):
            self._cancel([future])
            if task.shard:
                self._died(task.shard)
            return
        except Exception as problem:  # of the worker's side: the other shards go on
            if self.client.status != "running":
                raise shards_module.Refused("The scheduler is gone.") from None
            self._failed(task, worker, one_line(problem))
            return
        if task.shard:
            self._result(task, worker, answer)
        else:
            self._answer(task, worker, answer)

    def _answer(self, task, worker, refuses):
        words = [*refuses, *refuses.values()] if isinstance(refuses, dict) else [None]
        if not all(isinstance(word, str) for word in words):
            self._exclude(task, worker, "gave no answer to what it can run")
            return
        worker.answered = True
        worker.refuses = refuses
        if not refuses:
            return
        worker.rest()
        sets = sorted(refuses)
        more = f" So it does with {len(sets) - 1} more of the sets." if len(sets) > 1 else ""
        self._refusal(task.address, f"{refuses[sets[0]]}{more}")

    def _refusal(self, address, sentence):
        """Said once per machine, on which there may be many workers."""
        self.last_refusal = sentence
        said = address.rsplit(":", 1)[0], sentence
        if said not in self.said:
            self.said.add(said)
            self.say(f"Worker {address} refuses: {sentence}")

    def _exclude(self, task, worker, why):
        worker.answered = worker.excluded = True
        self.last_refusal = f"Worker {task.address} {why}."
        self.say(f"{self.last_refusal[:-1]}; it gets no more shards.")

    def _result(self, task, worker, answer):
        shard = task.shard
        result, refusal = answer if isinstance(answer, tuple) and len(answer) == 2 else (None, None)
        if refusal:  # its programs have been deleted since it was asked
            self.waiting.insert(0, shard)
            worker.refuses = {**(worker.refuses or {}), shard.set: str(refusal)}
            worker.rest()
            self._refusal(task.address, str(refusal))
        elif shards_module.fits(shard, result):
            worker.faults, worker.pause = 0, FIRST_PAUSE
            self.done(shard, result)
        else:
            self.waiting.insert(0, shard)
            self._exclude(task, worker, f"gave something that is no result of {shard.key}")

    def _failed(self, task, worker, problem):
        """A shard or question ended with an exception."""
        worker.faults += 1
        shard = task.shard
        if shard is None:
            # Most likely another version of this package.
            worker.answered = True
            worker.refuses = None
            worker.rest()
            self._refusal(task.address, f"It cannot say what it can run: {problem}.")
            return
        troubles = self.troubles.setdefault(shard, Troubles())
        troubles.failed_on.append(task.address)
        if len(troubles.failed_on) >= TRIES:
            self.failures.append(f"{shard.key}: {problem}.")
        else:
            self.waiting.insert(0, shard)
        if worker.faults >= FAULTS:
            self.last_refusal = f"{problem}."
            after = f"after {worker.faults} failures in succession"
            self.say(f"Worker {task.address} pauses for {worker.pause} s {after}: {problem}.")
            worker.refuses = None
            worker.rest(LONGEST_FAULT)

    def _died(self, shard):
        troubles = self.troubles.setdefault(shard, Troubles())
        troubles.deaths += 1
        if troubles.deaths >= LIVES:
            self.failures.append(f"{shard.key}: {LIVES} workers died while they ran it.")
        else:
            self.waiting.insert(0, shard)


def default_workers():
    return len(os.sched_getaffinity(0))


def summary(results):
    """One line per set: shards, what they did, and findings."""
    shards, done, found = Counter(), Counter(), Counter()
    for result in results:
        name = result["set"], shards_module.UNITS[result["kind"]]
        shards[name] += 1
        done[name] += result["done"]
        found[name] += result["finding"] is not None
    for name in sorted(shards):
        yield f"{name[0]:18} {done[name]:12,} {name[1]}, {shards[name]} shards, {found[name]} findings"
