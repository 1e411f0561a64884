"""Campaigns: the plan, resumption, killed workers, a defect, wrong arguments. `make campaign-test` builds what they run."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from dask.distributed import Client

from campaign.plan import Journal, plan
from campaign.shard import Refused

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = "build/campaign-test"
SET = "mhz25"
FAKE = {"a": {"kind": "fuzz", "hash": "1"}, "b": {"kind": "fuzz", "hash": "2"}, "c": {"kind": "soak", "hash": "3"}}


def command(state, *arguments, programs=PROGRAMS):
    workers = [] if "--scheduler" in arguments else ["--workers", "2"]
    return [
        sys.executable, "-m", "campaign", "--sets", SET, "--programs", programs, "--state", str(state),
        "--frames", "100", "--steps", "100", "--seed", "1", *workers, *(str(a) for a in arguments),
    ]


def run(state, *arguments, programs=PROGRAMS):
    return subprocess.run(
        command(state, *arguments, programs=programs), cwd=ROOT, capture_output=True, text=True, timeout=120
    )


def children(pid):
    """Processes below `pid`: pid -> command line."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rsplit(")", 1)[1].split()[1])
            if parent == pid:
                found[int(stat.parent.name)] = (stat.parent / "cmdline").read_text().replace("\0", " ")
                found.update(children(int(stat.parent.name)))
        except (OSError, IndexError):
            continue
    return found


def wait_for(condition, what, seconds=40):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError(f"{what} did not happen within {seconds} s")


def lines(state):
    files = list(Path(state).glob("*/shards.jsonl"))
    return [json.loads(line) for file in files for line in file.read_text().splitlines()]


class Plan(unittest.TestCase):
    def test_covers_all_frames_and_steps_exactly(self):
        for frames in (1, 7, 99, 100, 101, 12345):
            shards = plan(FAKE, frames, 50, 1, 100, 20)
            self.assertEqual(sum(s.size for s in shards if s.kind == "fuzz"), frames)
            self.assertEqual(sum(s.size for s in shards if s.kind == "soak"), 50)
            self.assertTrue(all(s.size <= 100 for s in shards))

    def test_is_the_same_for_the_same_arguments(self):
        self.assertEqual(plan(FAKE, 1000, 50, 7, 100, 20), plan(FAKE, 1000, 50, 7, 100, 20))
        self.assertNotEqual(plan(FAKE, 1000, 50, 7, 100, 20), plan(FAKE, 1000, 50, 8, 100, 20))

    def test_gives_every_shard_of_a_set_a_seed_of_its_own(self):
        shards = plan(FAKE, 1000, 100, 7, 100, 20)
        self.assertEqual(len({(s.set, s.seed) for s in shards}), len(shards))
        self.assertEqual(sorted(s.seed for s in shards if s.set == "a"), [7, 8, 9, 10, 11])


class Journals(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name

    def result(self, shard):
        return {**shard.__dict__, "done": shard.size, "seconds": 1, "finding": None}

    def test_forgets_a_line_cut_short_and_keeps_the_others(self):
        shards = plan(FAKE, 300, 20, 1, 100, 20)
        journal = Journal(self.root, shards)
        journal.add(shards[0], self.result(shards[0]))
        with open(journal.path, "a") as file:
            file.write('{"kind": "fu')
        journal.close()
        again = Journal(self.root, shards)
        self.assertEqual(list(again.results), [shards[0].key])
        again.add(shards[1], self.result(shards[1]))
        again.close()
        last = Journal(self.root, shards)
        self.assertEqual(set(last.results), {shards[0].key, shards[1].key})
        last.close()

    def test_of_another_set_is_another(self):
        changed = {**FAKE, "a": {"kind": "fuzz", "hash": "9"}}
        journals = [Journal(self.root, plan(sets, 300, 20, 1, 100, 20)) for sets in (FAKE, changed)]
        self.assertNotEqual(journals[0].folder, journals[1].folder)
        for journal in journals:
            journal.close()

    def test_is_written_by_one_process_at_a_time(self):
        journal = Journal(self.root, plan(FAKE, 300, 20, 1, 100, 20))
        with self.assertRaisesRegex(Refused, "running already"):
            Journal(self.root, plan(FAKE, 300, 20, 1, 100, 20))
        journal.close()


class Arguments(unittest.TestCase):
    def test_that_are_impossible_stop_with_one_sentence(self):
        for bad, name in (
            (["--frames", "0"], "'0'"),
            (["--frames", "many"], "'many'"),
            (["--seed", "-1"], "'-1'"),
            (["--sets", "a;b"], "'a;b'"),
            (["--sets", "none-such"], "none-such"),
            (["--scheduler", "host"], "'host'"),
            (["--programs", "build/none-such"], "none-such"),
        ):
            with self.subTest(bad), tempfile.TemporaryDirectory() as state:
                done = run(state, *bad)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(name, done.stderr)
                self.assertEqual(os.listdir(state), [])


class Cluster(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.state = folder.name

    def begin(self, *arguments):
        process = subprocess.Popen(
            command(self.state, *arguments), cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def players(self, process):
        return {pid: text for pid, text in children(process.pid).items() if "flyframe-fuzz" in text.split(" ")[0]}

    def test_resumes_after_an_interruption_and_repeats_nothing(self):
        size = ["--frames", 2000, "--shard-frames", 250]
        process = self.begin(*size)
        wait_for(lambda: lines(self.state), "the first finished shard")
        started = children(process.pid)
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does: to the workers too
        output, _ = process.communicate(timeout=40)
        self.assertEqual(process.returncode, 130, output)
        self.assertNotIn("Traceback", output)
        wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in started), "the end of all processes")
        before = lines(self.state)
        self.assertLess(len(before), 8, "the interruption came too late to test anything")
        done = run(self.state, *size)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"8 shards, of which {len(before)} are finished", done.stdout)
        after = lines(self.state)
        self.assertEqual(after[: len(before)], before)
        self.assertEqual(sorted(r["seed"] for r in after), list(range(1, 9)))

    def test_loses_nothing_when_a_worker_is_killed(self):
        process = self.begin("--frames", 2400, "--shard-frames", 600)
        player = min(wait_for(lambda: self.players(process), "the first player"))
        worker = int(Path(f"/proc/{player}/stat").read_text().rsplit(")", 1)[1].split()[1])
        self.assertNotEqual(worker, process.pid)
        os.kill(worker, signal.SIGKILL)
        # Nor does it leave a player behind that goes on.
        wait_for(lambda: not Path(f"/proc/{player}").exists(), "the end of the dead worker's player")
        output, _ = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, output)
        self.assertEqual(sorted(r["seed"] for r in lines(self.state)), [1, 2, 3, 4])
        self.assertTrue(all(r["done"] >= r["size"] for r in lines(self.state)))

    def test_reports_a_defect_with_the_command_that_repeats_it(self):
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as folder:
            mutant = Path(folder) / "mutant"
            shutil.copytree(ROOT / PROGRAMS, mutant)
            break_rtl(mutant)
            programs = str(mutant.relative_to(ROOT))
            done = run(self.state, "--frames", 500, "--shard-frames", 250, programs=programs)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            self.assertIn("2 of 2 shards finished, 2 findings", done.stdout)
            self.assertIn(f"FINDING in {SET}, seed 1, frames 1 to 250:", done.stderr + done.stdout)
            repeats = [l for l in (done.stdout + done.stderr).splitlines() if "repeat: " in l]
            self.assertEqual(len(repeats), 2)
            again = subprocess.run(
                repeats[0].split("repeat: ")[1], shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60
            )
            self.assertNotEqual(again.returncode, 0)
            found = {r["finding"]["text"].split("\nframes ")[0] for r in lines(self.state)}
            self.assertTrue(any(text in again.stdout for text in found), again.stdout + again.stderr)
            # The kept vectors show the same.
            vectors = next(Path(self.state).glob("*/*.vectors"))
            played = subprocess.run([mutant / "flyframe-fuzz", "--vectors", vectors], capture_output=True, text=True)
            self.assertEqual(played.returncode, 1, played.stdout)
            # Without the defect the same command finds nothing.
            well = repeats[0].split("repeat: ")[1].replace(programs, PROGRAMS)
            right = subprocess.run(well, shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60)
            self.assertEqual(right.returncode, 0, right.stdout + right.stderr)

    def begin_remote(self, scheduler, *arguments):
        return self.begin("--frames", 600, "--shard-frames", 100, "--scheduler", scheduler, *arguments)

    def test_on_a_scheduler_leaves_out_workers_of_another_checkout(self):
        with Remote() as remote:
            remote.start_worker(ROOT)
            remote.start_worker(remote.other)
            remote.wait_for_workers(2)
            process = self.begin_remote(remote.address)
            output, _ = process.communicate(timeout=90)
            self.assertEqual(process.returncode, 0, output)
            self.assertEqual(output.count("refuses: The hash of set"), 1)
            self.assertEqual(len(lines(self.state)), 6)

    def test_on_a_scheduler_waits_for_a_willing_worker(self):
        with Remote() as remote:
            remote.start_worker(remote.other)
            remote.wait_for_workers(1)
            process = self.begin_remote(remote.address, "--patience", 1)
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, output)
            self.assertEqual(output.count("every worker refuses it."), 6)
            process = self.begin_remote(remote.address)
            time.sleep(5)  # enough for refusals of all six shards
            self.assertIsNone(process.poll())
            # A willing worker that is killed and comes back at another address.
            willing = remote.start_worker(ROOT)
            wait_for(lambda: lines(self.state), "the first finished shard")
            willing.kill()
            willing.wait()
            self.assertLess(len(lines(self.state)), 6, "the worker was killed too late to test anything")
            remote.start_worker(ROOT)
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 0, output)
            self.assertEqual(sorted(r["seed"] for r in lines(self.state)), [1, 2, 3, 4, 5, 6])


def break_rtl(mutant):
    """Builds the player anew for a controller that takes every frame check sequence for right."""
    verilog = mutant / "verilog" / f"{SET}.v"
    broken, count = re.subn(r"(wire +crcRight = )crc == 32'hDEBB20E3;", r"\g<1>1'h1;", verilog.read_text())
    assert count == 1, "the place of the defect has changed"
    verilog.write_text(broken)
    folder = mutant.relative_to(ROOT)
    subprocess.run(
        ["make", "-s", "-f", "src/sim/sim.mk", f"{folder}/flyframe-fuzz", f"GENERATED={folder}/verilog",
         f"COSIM_OUT={folder}", f"PRESETS={SET}", "COSIM_TRACE=0", "COSIM_OPT=-O1"],
        cwd=ROOT, check=True, capture_output=True,
    )


class Remote:
    """A scheduler of its own, for workers of this checkout and of another one, whose set has another hash."""

    def __enter__(self):
        self.processes = []
        self.temporary = tempfile.TemporaryDirectory(dir=ROOT / "build")
        self.folder = Path(self.temporary.name)
        self.other = self.folder / "checkout"
        (self.other / PROGRAMS).mkdir(parents=True)
        sets = json.loads((ROOT / PROGRAMS / "sets.json").read_text())
        sets["sets"][SET]["hash"] = "0" * 32
        (self.other / PROGRAMS / "sets.json").write_text(json.dumps(sets))
        file = self.folder / "scheduler.json"
        self._start(ROOT, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        self.address = wait_for(
            lambda: file.exists() and file.read_text() and json.loads(file.read_text())["address"],
            "a scheduler",
        )
        return self

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()
        self.temporary.cleanup()

    def _start(self, cwd, *arguments):
        process = subprocess.Popen(
            [str(Path(sys.executable).parent / "dask"), *arguments, "--no-dashboard"], cwd=cwd,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        )
        self.processes.append(process)
        return process

    def start_worker(self, cwd):
        # Without a nanny the process is the worker itself, which a test may kill.
        return self._start(
            cwd, "worker", self.address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny",
            "--local-directory", str(self.folder),
        )

    def wait_for_workers(self, count):
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=40)


if __name__ == "__main__":
    unittest.main()
