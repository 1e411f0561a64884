"""Runs shards on the workers of a Dask scheduler."""

import os
import signal
import time
from collections import Counter

import dask
from dask.distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
from distributed.scheduler import KilledWorker

from campaign import shard as shards_module

# A shard is tried again after so many deaths of workers, and after one more it is given up.
LIVES = 3
# So many seconds a campaign waits for a worker that does not refuse, when it has nothing else to do.
PATIENCE = 60


def work(shard, programs):
    """Runs on a worker: its address, and the result, or the sentence with which it refuses the shard."""
    address = get_worker().address
    try:
        return address, shards_module.run(shard, programs), None
    except shards_module.Refused as refusal:
        return address, None, str(refusal)


class LeavesInterrupts(WorkerPlugin):
    """A terminal sends Ctrl-C to every process; the campaign alone acts on it, and ends its workers."""

    def setup(self, worker):
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def local_cluster(workers, scratch):
    """A cluster of processes of this machine that nobody else can reach."""
    dask.config.set({"distributed.scheduler.allowed-failures": LIVES})
    return LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0",
        worker_dashboard_address=None, local_directory=str(scratch), silence_logs=50,
    )


def connect(scheduler=None, cluster=None):
    """A client of the scheduler at this address, or of this machine's cluster. Raises OSError if there is none."""
    client = Client(scheduler or cluster.scheduler_address, timeout="10s", set_as_default=False)
    if cluster:
        client.register_plugin(LeavesInterrupts())
    return client


class Runner:
    """Submits shards, and submits again elsewhere what a worker refuses because its checkout is another one."""

    def __init__(self, client, programs, patience=PATIENCE):
        self.client, self.programs, self.patience = client, programs, patience
        self.refusals = {}  # address of a worker -> its sentence
        self.failures = []  # sentences about shards that could not be run

    def _willing(self, seconds):
        """Addresses of the workers that have not refused, for which it waits so long."""
        end = time.monotonic() + seconds
        while True:
            willing = sorted(set(self.client.scheduler_info(n_workers=-1)["workers"]) - set(self.refusals))
            if willing or time.monotonic() >= end:
                return willing
            time.sleep(min(1, seconds))

    def run(self, shards, done, say):
        """Calls `done(shard, result)` as shards end, in any order; `say(sentence)` when a worker refuses."""
        waiting, refused = {}, []
        completed = as_completed(loop=self.client.loop)

        def submit(shard, willing=None):
            # Other workers are allowed, as the willing ones may be gone when the shard's turn comes, and come
            # back at another address. So an idle worker may steal a shard that it refuses; that costs little.
            future = self.client.submit(
                work, shard, self.programs, pure=False, workers=willing, allow_other_workers=bool(willing)
            )
            waiting[future] = shard
            completed.add(future)

        try:
            for shard in shards:
                submit(shard)
            while waiting or refused:
                if refused:
                    # A willing worker may join later than those that refuse.
                    willing = self._willing(0 if waiting else self.patience)
                    if not willing and not waiting:
                        self.failures += [f"{shard.key}: every worker refuses it." for shard in refused]
                        return
                    while willing and refused:
                        submit(refused.pop(), willing)
                future = next(completed)
                shard = waiting.pop(future)
                try:
                    address, result, refusal = future.result()
                except KilledWorker:
                    self.failures.append(f"{shard.key}: too many workers died while they ran it.")
                    continue
                except Exception as problem:  # of the worker's side: the other shards go on
                    self.failures.append(f"{shard.key}: {problem}")
                    continue
                if result:
                    done(shard, result)
                    continue
                if address not in self.refusals:
                    self.refusals[address] = refusal
                    say(f"Worker {address} refuses: {refusal}")
                refused.append(shard)
        finally:
            self.client.cancel(list(waiting), force=True)


def default_workers():
    return len(os.sched_getaffinity(0))


def summary(results):
    """One line per set: shards, frames or steps, and findings."""
    shards, done, found = Counter(), Counter(), Counter()
    for result in results:
        name = result["set"], "frames" if result["kind"] == "fuzz" else "steps"
        shards[name] += 1
        done[name] += result["done"]
        found[name] += result["finding"] is not None
    for name in sorted(shards):
        yield f"{name[0]:18} {done[name]:12,} {name[1]}, {shards[name]} shards, {found[name]} findings"
