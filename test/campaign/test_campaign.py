"""Campaigns: the plan, resumption, programs, killed workers, a defect, wrong arguments.

`make campaign-test` builds what they run.
"""

import concurrent.futures
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
import unittest.mock
from pathlib import Path

from dask.distributed import Client

from campaign import programs as programs_module
from campaign import shard as shard_module
from campaign import record
from campaign import runner as runner_module
from campaign.plan import Journal, plan
from campaign.shard import Refused, Shard

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = "build/campaign-test"
SET = "mhz25"
FAKE = {
    "a": {"kind": "fuzz", "hash": "1"},
    "b": {"kind": "fuzz", "hash": "2"},
    "c": {"kind": "soak", "hash": "3"},
    "d": {"kind": "faults", "hash": "4"},
}


SIZES = {"fuzz": 100, "soak": 20, "faults": 30}


def done_of(shard):
    """A good result."""
    return {**shard.__dict__, "done": shard.size, "seconds": 1, "finding": None}


def totals(frames, steps):
    return {"fuzz": frames, "soak": steps, "faults": 70}


def command(state, *arguments, programs=PROGRAMS):
    workers = [] if "--scheduler" in arguments else ["--workers", "2"]
    return [
        sys.executable, "-m", "campaign", "--sets", SET, "--programs", programs, "--state", str(state),
        "--frames", "100", "--steps", "100", "--cycles", "100", "--seed", "1",
        *workers, *(str(a) for a in arguments),
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
            shards = plan(FAKE, totals(frames, 50), 1, SIZES)
            self.assertEqual(sum(s.size for s in shards if s.kind == "fuzz"), frames)
            self.assertEqual(sum(s.size for s in shards if s.kind == "soak"), 50)
            self.assertEqual([s.size for s in shards if s.kind == "faults"], [30, 30, 10])
            self.assertTrue(all(s.size <= 100 for s in shards))

    def test_is_the_same_for_the_same_arguments(self):
        self.assertEqual(plan(FAKE, totals(1000, 50), 7, SIZES), plan(FAKE, totals(1000, 50), 7, SIZES))
        self.assertNotEqual(plan(FAKE, totals(1000, 50), 7, SIZES), plan(FAKE, totals(1000, 50), 8, SIZES))

    def test_gives_every_shard_of_a_set_a_seed_of_its_own(self):
        shards = plan(FAKE, totals(1000, 100), 7, SIZES)
        self.assertEqual(len({(s.set, s.seed) for s in shards}), len(shards))
        self.assertEqual(sorted(s.seed for s in shards if s.set == "a"), [7, 8, 9, 10, 11])

    def test_with_more_frames_goes_on_behind_the_finished_shards(self):
        for frames, more in ((1, 2), (250, 450), (1000, 1001), (999, 12345)):
            small = plan(FAKE, totals(frames, 50), 7, SIZES)
            large = plan(FAKE, totals(more, 90), 7, SIZES, small)
            self.assertLess(set(small), set(large))
            self.assertEqual(sum(s.size for s in large if s.kind == "fuzz"), more)
            self.assertEqual(sum(s.size for s in large if s.kind == "soak"), 90)
            self.assertEqual(len({(s.set, s.seed) for s in large}), len(large))
            # Only some of the smaller are finished, in any order.
            some = small[::2]
            large = plan(FAKE, totals(more, 90), 7, SIZES, some)
            self.assertLessEqual(set(some), set(large))
            self.assertEqual(sum(s.size for s in large if s.kind == "fuzz"), more)

    def test_with_fewer_frames_runs_nothing_that_is_finished(self):
        large = plan(FAKE, totals(1000, 100), 7, SIZES)
        self.assertLessEqual(set(plan(FAKE, totals(330, 30), 7, SIZES, large)), set(large))

    def test_takes_no_shard_of_other_programs_for_finished(self):
        changed = {**FAKE, "a": {"kind": "fuzz", "hash": "9"}}
        finished = plan(changed, totals(250, 50), 7, SIZES)
        self.assertFalse({s for s in plan(FAKE, totals(450, 50), 7, SIZES, finished) if s.hash == "9"})


class Journals(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name
        self.shards = plan(FAKE, totals(300, 20), 1, SIZES)

    def journal(self, sets=FAKE, seed=1):
        journal = Journal(self.root, sets, seed)
        self.addCleanup(journal.close)
        return journal

    def write(self, *contents):
        """Lines of a journal that nobody holds."""
        journal = self.journal()
        journal.close()
        journal.path.write_bytes(b"".join(contents))

    def line(self, shard, **changed):
        return json.dumps({**done_of(shard), **changed}).encode() + b"\n"

    def test_forgets_a_line_cut_short_and_keeps_the_others(self):
        shards = self.shards
        self.write(self.line(shards[0]), b'{"kind": "fu')
        again = self.journal()
        self.assertEqual(list(again.results), [shards[0]])
        again.add(shards[1], done_of(shards[1]))
        again.close()
        self.assertEqual(set(self.journal().results), {shards[0], shards[1]})

    def test_passes_over_lines_that_are_no_results(self):
        a, b, *_ = self.shards
        bad = (
            b'{"kind": "fu' + self.line(b), b"\n", b"[]\n", b"7\n", b"\xff\xfe\n", b"{}\n",
            self.line(b, done="x"), self.line(b, done=b.size - 1), self.line(b, size=-1),
            self.line(b, finding={}), self.line(b, seed=[1]), self.line(b, set=None),
        )
        self.write(*bad, self.line(a))
        journal = self.journal()
        self.assertEqual(list(journal.results), [a])
        self.assertEqual(journal.damaged, list(range(1, len(bad) + 1)))

    def test_on_a_full_disk_says_so_and_keeps_what_is_whole(self):
        journal = self.journal()
        journal.add(self.shards[0], done_of(self.shards[0]))
        whole = journal.path.read_bytes()
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        # Python ignores the signal, so that a write beyond it fails, behind the part that fits.
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) + 10, hard))
        try:
            with self.assertRaisesRegex(Refused, r"cannot be written to .*shards\.jsonl: .*\."):
                journal.add(self.shards[1], done_of(self.shards[1]))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        self.assertEqual(journal.path.read_bytes(), whole)
        journal.add(self.shards[1], done_of(self.shards[1]))
        journal.close()
        self.assertEqual(list(self.journal().results), self.shards[:2])

    def test_of_another_set_or_seed_is_another(self):
        changed = {**FAKE, "a": {"kind": "fuzz", "hash": "9"}}
        journals = [self.journal(), self.journal(changed), self.journal(seed=2)]
        self.assertEqual(len({journal.folder for journal in journals}), 3)

    def test_is_written_by_one_process_at_a_time(self):
        self.journal()
        with self.assertRaisesRegex(Refused, "running already"):
            self.journal()

    def test_that_cannot_be_made_is_refused(self):
        (Path(self.root) / "file").touch()
        with self.assertRaisesRegex(Refused, "cannot be used"):
            Journal(Path(self.root) / "file", FAKE, 1)


class Record(unittest.TestCase):
    """What make campaign-record makes of finished shards."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def journal(self, name, *runs):
        path = self.folder / name
        path.write_text("".join(json.dumps(r) + "\n" for r in runs) + "cut sho")
        return path

    @staticmethod
    def finished(seed, kind="faults", name="d", summary="frames 12 (lost 1)", finding=None):
        return {
            "kind": kind, "set": name, "hash": "4", "seed": seed, "size": 10, "done": 11,
            "seconds": 1800, "summary": summary, "finding": finding,
        }

    def test_takes_every_shard_once_with_the_commit_it_came_with(self):
        record_ = self.folder / "campaigns.csv"
        first = record.update(record_, [self.journal("a", self.finished(1))], "aaa")
        record.write(record_, first)
        again = [self.journal("a", self.finished(1), self.finished(2)), self.journal("b", self.finished(2))]
        runs = record.update(record_, again, "bbb")
        self.assertEqual([(r["seed"], r["commit"]) for r in runs], [(1, "aaa"), (2, "bbb")])

    def test_adds_up_amounts_frames_and_findings(self):
        states = [
            self.journal("a", self.finished(1), self.finished(2, finding="it differs")),
            self.journal("b", self.finished(1, kind="fuzz", name="a", summary="")),
        ]
        part = record.section(record.update(self.folder / "none", states, "aaa"))
        self.assertIn("| d | aaa | 2 | cycles | 22 | 24 | 1.0 | 1 |\n", part)
        self.assertIn("| **all** |  | 2 | cycles | 22 | 24 | 1.0 | 1 |\n", part)
        self.assertIn("| a | aaa | 1 | frames | 11 | 11 | 0.5 | 0 |\n", part)

    def test_changes_its_own_section_of_the_page_only(self):
        page = "# Soak\n\n## Results\n\ntext\n"
        once = record.in_page(page, record.HEADING + "\n\none\n")
        self.assertEqual(once, page + "\n" + record.HEADING + "\n\none\n")
        two = record.HEADING + "\ntwo\n"
        self.assertEqual(record.in_page(once, two), page + "\n" + two)


class Programs(unittest.TestCase):
    """Programs kept by content; these do nothing."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name) / "programs"
        self.said = []

    def build(self, digest, jar="a.jar"):
        """A command that builds programs in which the set `a` has this hash."""
        sets = json.dumps({"jars": [jar], "sets": {"a": {"kind": "fuzz", "hash": digest}}})
        return (
            f"cd {self.folder}; mkdir -p jars; "
            f"for f in flyframe-fuzz flyframe-smsoak flyframe-faults jars/{jar}; do "
            f"echo {digest} >$f; done; echo '{sets}' >sets.json"
        )

    def kept(self, *arguments):
        return programs_module.kept(self.folder, *arguments, say=self.said.append)

    def age(self, folder):
        os.utime(folder / "lock", (0, 0))

    def folders(self):
        return sorted((self.folder / "kept").iterdir())

    def test_of_a_campaign_stay_while_others_are_built(self):
        with self.kept(self.build("1")) as first:
            self.age(first)
            with self.kept(self.build("2")) as second:
                self.assertNotEqual(first, second)
                self.assertEqual((first / "flyframe-fuzz").read_text(), "1\n")
                self.assertEqual((second / "jars" / "a.jar").read_text(), "2\n")
            with programs_module.using(self.folder, "a", "1") as found:
                self.assertEqual(found, first)
            with programs_module.using(self.folder, "a", "2") as found:
                self.assertEqual(found, second)

    def test_of_a_campaign_are_used_though_others_have_the_same_hash(self):
        with self.kept(self.build("1")) as first:
            with self.kept(f"{self.build('1')}; echo other compiler >flyframe-fuzz") as second:
                self.assertNotEqual(first, second)
                for own in (first, second):
                    with programs_module.using(self.folder, "a", "1", own.name) as found:
                        self.assertEqual(found, own)
                with programs_module.using(self.folder, "a", "1", "of another machine") as found:
                    self.assertIn(found, (first, second))

    def test_of_the_same_content_are_kept_once(self):
        with self.kept(self.build("1")) as first:
            pass
        with self.kept(self.build("1")) as second, self.kept() as third:
            self.assertEqual({first, second, third}, set(self.folders()))

    def test_go_when_nobody_uses_them(self):
        with self.kept(self.build("1", "old.jar")) as old, self.kept(self.build("2")) as used:
            pass
        with self.kept(self.build("3")) as recent:
            pass
        (self.folder / "kept" / ".new-interrupted").mkdir()
        self.age(old)
        self.age(used)
        with programs_module.using(self.folder, "a", "2"):
            self.age(used)  # a worker has been running a shard of them for long
            with self.kept(self.build("4")) as now:
                self.assertEqual(self.folders(), sorted([used, recent, now]))
        self.assertEqual([jar.name for jar in (self.folder / "jars").iterdir()], ["a.jar"])
        with self.assertRaisesRegex(Refused, "^The hash of set a is . in .* but must be 1.$"):
            programs_module.find(self.folder, "a", "1")

    def test_are_built_by_one_at_a_time(self):
        log = self.folder / "log"
        slow = f"echo begin >>{log}; sleep 1; {self.build('1')}; echo end >>{log}"
        command = [sys.executable, "-m", "campaign.programs", str(self.folder), slow]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        both = [subprocess.Popen(command, **pipes) for _ in range(2)]
        said = "".join(process.communicate(timeout=30)[0] for process in both)
        self.assertEqual([process.returncode for process in both], [0, 0], said)
        self.assertEqual(log.read_text().split(), ["begin", "end", "begin", "end"])
        self.assertEqual(said.count("waiting until that has ended."), 1, said)

    def test_that_cannot_be_built_leave_the_others(self):
        with self.kept(self.build("1")) as first:
            pass
        for command, sentence in (
            ("exit 3", "The programs could not be built: the build ended with exit code 3."),
            (f"{self.build('2')}; rm {self.folder}/flyframe-smsoak", "flyframe-smsoak is missing"),
            (f"echo '{{' >{self.folder}/sets.json", "sets.json is damaged"),
        ):
            arguments = [sys.executable, "-m", "campaign.programs", str(self.folder), command]
            done = subprocess.run(arguments, capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(sentence, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertEqual(self.folders(), [first])
            with self.assertRaises(Refused):
                with self.kept():
                    pass

    def test_that_do_not_fit_on_the_disk_leave_nothing(self):
        with self.kept(self.build("1")) as first:
            pass
        big = f"{self.build('2')}; seq 1000 >flyframe-fuzz"
        # The campaign alone is limited, not the build.
        code = textwrap.dedent("""
            import resource, sys
            from campaign import programs
            build = programs._build
            def limited(*arguments):
                build(*arguments)
                resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
            programs._build = limited
            sys.exit(programs.main(sys.argv[1:]))
        """)
        done = subprocess.run(
            [sys.executable, "-c", code, str(self.folder), big], capture_output=True, text=True
        )
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("File too large", done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(self.folders(), [first])


class Shards(unittest.TestCase):
    """One shard, whose player takes half a line for a difference."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        player = Path(folder.name) / "flyframe-fuzz"
        differs = "echo 'frame 3: differs'; echo 'frames 3, x'; exit 1"
        player.write_text(f"#!/bin/sh\nread whole || {{ {differs}; }}\n")
        player.chmod(0o755)
        sets = {"jars": [], "sets": {"a": {"kind": "fuzz", "hash": "1"}}}
        (Path(folder.name) / "sets.json").write_text(json.dumps(sets))
        self.folder = folder.name

    def run_with(self, write):
        with unittest.mock.patch("campaign.shard.writer", lambda *_: ["sh", "-c", write]):
            return shard_module.run(Shard("fuzz", "a", 1, 3, "1"), self.folder)

    def test_whose_writer_is_killed_is_no_finding(self):
        sentence = "writer of the vectors of fuzz-a-1-3-1 ended with exit code -9"
        with self.assertRaisesRegex(RuntimeError, sentence):
            self.run_with("printf half; kill -9 $$")

    def test_whose_writer_goes_on_behind_a_difference_is_one(self):
        for write in ("printf half; exec >&-; sleep 60", "printf half"):
            self.assertIn("differs", self.run_with(write)["finding"]["text"])


class Arguments(unittest.TestCase):
    def test_that_are_impossible_stop_with_one_sentence(self):
        for bad, name in (
            (["--frames", "0"], "'0'"),
            (["--frames", "many"], "'many'"),
            (["--frames", ""], "''"),
            (["--frames=-5"], "'-5'"),
            (["--frames", "1e5"], "'1e5'"),
            (["--frames", "9" * 5000], "99999"),
            (["--steps", "0"], "'0'"),
            (["--cycles", "0"], "'0'"),
            (["--seed", "-1"], "'-1'"),
            (["--seed", str(2**63 - 1)], f"'{2**63 - 1}'"),
            (["--seed", str(2**31)], f"{2**31 - 1}"),
            (["--sets", ""], "''"),
            (["--sets", "a;b"], "'a;b'"),
            (["--sets", "none-such"], "none-such"),
            (["--scheduler", "host"], "'host'"),
            (["--scheduler", "tcp://host:99999"], "'tcp://host:99999'"),
            (["--programs", "build/none-such"], "none-such"),
            (["--state", "README.md"], "README.md"),
        ):
            with self.subTest(bad), tempfile.TemporaryDirectory() as state:
                done = run(state, *bad)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(name, done.stderr)
                self.assertEqual(os.listdir(state), [])

    def test_of_a_single_shard_that_are_impossible_stop_with_one_sentence(self):
        for bad, name in (
            ([PROGRAMS, SET, "1", "0"], "'0'"),
            ([PROGRAMS, SET, "1", "x"], "'x'"),
            ([PROGRAMS, SET, str(2**63), "1"], f"'{2**63}'"),
            ([PROGRAMS, "none-such", "1", "1"], "none-such"),
            (["build/none-such", SET, "1", "1"], "none-such"),
        ):
            with self.subTest(bad):
                done = subprocess.run(
                    [sys.executable, "-m", "campaign.shard", *bad], cwd=ROOT, capture_output=True, text=True
                )
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(name, done.stderr)

    def test_scheduler_that_does_not_answer_stops_with_one_sentence(self):
        with tempfile.TemporaryDirectory() as state:
            done = run(state, "--scheduler", "tcp://127.0.0.1:9")
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(done.stderr, "campaign: No scheduler answers at tcp://127.0.0.1:9.\n")

    def test_with_fewer_frames_than_sets_are_said(self):
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as folder:
            copy = Path(folder) / "copy"
            shutil.copytree(ROOT / PROGRAMS, copy, ignore=shutil.ignore_patterns("kept"))
            sets = json.loads((copy / "sets.json").read_text())
            sets["sets"]["other"] = sets["sets"][SET]
            (copy / "sets.json").write_text(json.dumps(sets))
            arguments = ["--sets", f"{SET} other", "--frames", 1]
            done = run(folder, *arguments, programs=str(copy.relative_to(ROOT)))
            self.assertEqual(done.returncode, 0, done.stderr)
            said = "sets without a shard, as there are fewer frames, steps or cycles than sets: other.\n"
            self.assertIn(said, done.stderr)


class SlowScheduler:
    """Two workers: `broken` fails at once with each shard, `slow` is late to say what it refuses.

    It says so at the second look at the workers: by then the other one could have failed often.
    """

    status = "running"

    def __init__(self, refuses):
        self.refuses, self.question, self.looks = refuses, None, 0
        self.given = []  # whom shards were given to

    def scheduler_info(self, n_workers):
        self.looks += 1
        if self.looks == 2:
            self.question.set_result(self.refuses)
        return {"workers": {name: {"nthreads": 1} for name in ("broken", "slow")}}

    def submit(self, function, *arguments, workers, **_):
        future, (worker,) = concurrent.futures.Future(), workers
        if function is runner_module.work:
            self.given.append(worker)
            if worker == "broken":
                future.set_exception(OSError(28, "No space left on device"))
            else:
                future.set_result((done_of(arguments[0]), None))
        elif worker == "broken":
            future.set_result({})
        else:
            self.question = future
        return future

    def cancel(self, futures, force):
        pass


class Choice(unittest.TestCase):
    """Which worker gets a shard that has failed."""

    def run_one(self, refuses):
        client, results = SlowScheduler(refuses), []
        runner = runner_module.Runner(client, PROGRAMS, "0")
        shard = plan(FAKE, totals(100, 20), 1, SIZES)[0]
        runner.run([shard], lambda _, result: results.append(result), lambda _: None)
        return client.given, results == [done_of(shard)], runner.failures

    def test_is_one_that_has_not_said_yet_what_it_refuses(self):
        self.assertEqual(self.run_one({}), (["broken", "slow"], True, []))

    def test_is_the_same_if_the_other_one_refuses_it(self):
        given, done, failures = self.run_one({"a": "The hash of set a differs."})
        self.assertEqual((given, done, len(failures)), (["broken", "broken"], False, 1))


class Cluster(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.state = folder.name

    def begin(self, *arguments, state=None, programs=PROGRAMS):
        process = subprocess.Popen(
            command(state or self.state, *arguments, programs=programs), cwd=ROOT, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def players(self, process):
        found = children(process.pid).items()
        return {pid: text for pid, text in found if "flyframe-fuzz" in text.split(" ")[0]}

    def wait_for_end_of(self, started):
        wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in started), "the end of all")

    def test_resumes_after_an_interruption_and_repeats_nothing(self):
        size = ["--frames", 2000, "--shard-frames", 250]
        process = self.begin(*size)
        wait_for(lambda: lines(self.state), "the first finished shard")
        started = children(process.pid)
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does: to the workers too
        output, _ = process.communicate(timeout=40)
        self.assertEqual(process.returncode, 130, output)
        self.assertNotIn("Traceback", output)
        self.wait_for_end_of(started)
        before = lines(self.state)
        self.assertLess(len(before), 8, "the interruption came too late to test anything")
        done = run(self.state, *size)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"8 shards, of which {len(before)} are finished", done.stdout)
        after = lines(self.state)
        self.assertEqual(after[: len(before)], before)
        self.assertEqual(sorted(r["seed"] for r in after), list(range(1, 9)))

    def test_with_more_frames_runs_only_the_new_shards(self):
        done = run(self.state, "--frames", 250, "--shard-frames", 100)
        self.assertIn("3 shards, of which 0 are finished", done.stdout, done.stderr)
        before = lines(self.state)
        done = run(self.state, "--frames", 450, "--shard-frames", 100)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("5 shards, of which 3 are finished", done.stdout)
        self.assertIn("5 of 5 shards finished, 0 findings; this run: 2 shards", done.stdout)
        self.assertEqual(lines(self.state)[:3], before)
        new = [(r["seed"], r["size"]) for r in lines(self.state)[3:]]
        self.assertEqual(sorted(new), [(4, 100), (5, 100)])
        done = run(self.state, "--frames", 100, "--shard-frames", 100)
        self.assertIn("1 shards, of which 1 are finished", done.stdout, done.stderr)
        self.assertEqual(len(lines(self.state)), 5)

    def test_ends_in_order_whenever_it_is_interrupted(self):
        for seconds in (0.5, 1.5, 3, 5):
            with self.subTest(seconds), tempfile.TemporaryDirectory() as state:
                process = self.begin("--frames", 100000, "--shard-frames", 1000, state=state)
                time.sleep(seconds)
                started = children(process.pid)
                os.killpg(process.pid, signal.SIGINT)
                output, _ = process.communicate(timeout=40)
                self.assertEqual(process.returncode, 130, output)
                self.assertNotIn("Traceback", output)
                self.assertRegex(output, "campaign: interrupted")
                self.wait_for_end_of(started)

    def test_ends_at_once_when_it_is_interrupted_twice(self):
        process = self.begin("--frames", 100000, "--shard-frames", 200)
        wait_for(lambda: lines(self.state), "the first finished shard")
        started = children(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)
        began = time.monotonic()
        output, _ = process.communicate(timeout=40)
        self.assertLess(time.monotonic() - began, 5)
        self.assertEqual(process.returncode, 130, output)
        self.assertNotIn("Traceback", output)
        self.wait_for_end_of(started)
        before = lines(self.state)  # each line is whole
        finished = sum(result["seed"] == 1 for result in before)  # the only one that is wanted now
        done = run(self.state, "--frames", 100, "--shard-frames", 200)
        self.assertIn(f"1 shards, of which {finished} are finished", done.stdout, done.stderr)
        self.assertEqual(lines(self.state)[: len(before)], before)

    def test_stops_with_a_sentence_when_the_disk_is_full(self):
        process = self.begin("--frames", 2400, "--shard-frames", 200)
        wait_for(lambda: lines(self.state), "the first finished shard")
        # For this process alone, not for its workers.
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (600, 600))
        output, _ = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 2, output)
        self.assertRegex(output, r"cannot be written to .*; the same command goes on behind \d of 12 shards")
        self.assertNotIn("Traceback", output)
        before = lines(self.state)
        done = run(self.state, "--frames", 2400, "--shard-frames", 200)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"12 shards, of which {len(before)} are finished", done.stdout)

    def test_keeps_its_programs_while_others_are_built(self):
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as folder:
            copy = Path(folder) / "copy"
            shutil.copytree(ROOT / PROGRAMS, copy, ignore=shutil.ignore_patterns("kept"))
            programs = str(copy.relative_to(ROOT))
            process = self.begin("--frames", 100000, "--shard-frames", 200, programs=programs)
            wait_for(lambda: lines(self.state), "the first finished shard")
            # Another campaign of this checkout builds, of other sources.
            sets = json.loads((copy / "sets.json").read_text())
            sets["sets"][SET]["hash"] = "f" * 32
            other = Path(folder) / "sets.json"
            other.write_text(json.dumps(sets))
            build = f"echo >>{programs}/flyframe-fuzz; cp {other} {programs}/sets.json"
            with tempfile.TemporaryDirectory() as state:
                done = run(state, "--frames", 100, "--build", build, programs=programs)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                self.assertEqual({r["hash"] for r in lines(state)}, {"f" * 32})
            count = len(lines(self.state))
            wait_for(lambda: len(lines(self.state)) > count + 3, "three more shards")
            os.killpg(process.pid, signal.SIGINT)
            output, _ = process.communicate(timeout=40)
            self.assertEqual(process.returncode, 130, output)
            self.assertNotIn("refuse", output)
            self.assertNotIn("f" * 32, {r["hash"] for r in lines(self.state)})

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
            shutil.copytree(ROOT / PROGRAMS, mutant, ignore=shutil.ignore_patterns("kept"))
            break_rtl(mutant)
            programs = str(mutant.relative_to(ROOT))
            done = run(self.state, "--frames", 500, "--shard-frames", 250, programs=programs)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            self.assertIn("2 of 2 shards finished, 2 findings", done.stdout)
            self.assertIn(f"FINDING in {SET}, seed 1, frames 1 to 250:", done.stderr + done.stdout)
            repeats = [l for l in (done.stdout + done.stderr).splitlines() if "repeat: " in l]
            self.assertEqual(len(repeats), 2)
            again = subprocess.run(
                repeats[0].split("repeat: ")[1], shell=True, cwd=ROOT, capture_output=True, text=True,
                timeout=60,
            )
            self.assertNotEqual(again.returncode, 0)
            found = {r["finding"]["text"].split("\nframes ")[0] for r in lines(self.state)}
            self.assertTrue(any(text in again.stdout for text in found), again.stdout + again.stderr)
            # The kept vectors show the same.
            vectors = next(Path(self.state).glob("*/*.vectors"))
            player = [mutant / "flyframe-fuzz", "--vectors", vectors]
            played = subprocess.run(player, capture_output=True, text=True)
            self.assertEqual(played.returncode, 1, played.stdout)
            # Without the defect the same command finds nothing.
            well = repeats[0].split("repeat: ")[1].replace(programs, PROGRAMS)
            right = subprocess.run(well, shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60)
            self.assertEqual(right.returncode, 0, right.stdout + right.stderr)

    def begin_remote(self, scheduler, *arguments):
        return self.begin("--frames", 600, "--shard-frames", 100, "--scheduler", scheduler, *arguments)

    def test_on_a_scheduler_gives_no_shard_to_workers_of_another_checkout(self):
        with Remote() as remote:
            log = remote.folder / "log"
            # Both of its machine's workers, with a package that writes down what it is asked.
            spy = remote.package(f"""
                import time
                def written(function):
                    def call(*arguments):
                        open({str(log)!r}, "a").write(f"{{function.__name__}} {{time.time()}}\\n")
                        return function(*arguments)
                    return call
                probe, work = written(probe), written(work)
            """)
            remote.start_worker(remote.other, spy)
            remote.start_worker(remote.other, spy)
            remote.start_worker(ROOT)
            remote.wait_for_workers(3)
            process = self.begin_remote(remote.address)
            output, _ = process.communicate(timeout=90)
            self.assertEqual(process.returncode, 0, output)
            self.assertEqual(output.count("refuses: The hash of set"), 1, output)
            self.assertEqual(len(lines(self.state)), 6)
            asked = [line.split() for line in log.read_text().splitlines()]
            self.assertEqual({name for name, _ in asked}, {"probe"})
            # At the beginning, then after 2 s, 4 s, 8 s, and every 10 s.
            seconds = max(float(t) for _, t in asked) - min(float(t) for _, t in asked)
            self.assertLessEqual(len(asked), 2 * (3 + seconds / 4))

    def test_on_a_scheduler_is_not_misled_by_a_worker_that_lies(self):
        with Remote() as remote:
            liar = remote.package("""
                def work(shard, kept, programs):
                    other = {**shard.__dict__, "seed": shard.seed + 1}
                    return {**other, "done": shard.size, "seconds": 1, "summary": "", "finding": None}, None
            """)
            remote.start_worker(ROOT, liar)
            remote.wait_for_workers(1)
            process = self.begin_remote(remote.address, "--patience", 30)
            first = wait_for(lambda: process.stdout.readline(), "the plan")
            wait_for(lambda: "no result of" in process.stdout.readline(), "the discovery")
            remote.start_worker(ROOT)
            output, _ = process.communicate(timeout=90)
            self.assertEqual(process.returncode, 0, first + output)
            self.assertEqual(sorted(r["seed"] for r in lines(self.state)), [1, 2, 3, 4, 5, 6])
            self.assertFalse([r for r in lines(self.state) if r["summary"] == ""])

    def test_on_a_scheduler_gives_what_failed_to_another_worker(self):
        with Remote() as remote:
            broken = remote.package("""
                def work(shard, kept, programs):
                    raise OSError(28, "No space left on device")
            """)
            remote.start_worker(ROOT, broken)
            remote.start_worker(ROOT)
            remote.wait_for_workers(2)
            process = self.begin_remote(remote.address)
            output, _ = process.communicate(timeout=90)
            self.assertEqual(process.returncode, 0, output)
            self.assertIn("after 3 failures in succession: [Errno 28] No space left on device.", output)
            self.assertEqual(len(lines(self.state)), 6)

    def test_on_a_scheduler_whose_workers_all_fail_stops_with_sentences(self):
        with Remote() as remote:
            broken = remote.package("""
                def work(shard, kept, programs):
                    raise OSError(28, "No space left on device")
            """)
            remote.start_worker(ROOT, broken)
            remote.wait_for_workers(1)
            process = self.begin_remote(remote.address, "--patience", 1)
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, output)
            self.assertNotIn("Traceback", output)
            # The first shard was tried twice, the next one once.
            self.assertEqual(output.count("not run: "), 2, output)
            self.assertIn("campaign: not run: 5 shards of mhz25: no worker is willing", output)

    def test_on_a_scheduler_that_dies_stops_with_one_sentence(self):
        with Remote() as remote:
            remote.start_worker(ROOT)
            remote.wait_for_workers(1)
            process = self.begin_remote(remote.address)
            wait_for(lambda: lines(self.state), "the first finished shard")
            remote.scheduler.kill()
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, output)
            self.assertNotIn("Traceback", output)
            # Tests beside this one may be building.
            waiting = output.count("campaign: Programs are being built")
            self.assertEqual(output.count("campaign: ") - waiting, 1, output)
            self.assertRegex(output, r"The scheduler is gone; the same command goes on behind \d of 6 ")
        before = lines(self.state)
        done = run(self.state, "--frames", 600, "--shard-frames", 100)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"6 shards, of which {len(before)} are finished", done.stdout)

    def test_on_a_scheduler_without_workers_stops_with_one_sentence(self):
        with Remote() as remote:
            process = self.begin_remote(remote.address, "--patience", 1)
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, output)
            self.assertIn("campaign: not run: 6 shards of mhz25: there is no worker.\n", output)

    def test_on_a_scheduler_waits_for_a_willing_worker(self):
        with Remote() as remote:
            remote.start_worker(remote.other)
            remote.wait_for_workers(1)
            process = self.begin_remote(remote.address, "--patience", 1)
            output, _ = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, output)
            self.assertEqual(output.count("campaign: not run: "), 1, output)
            self.assertRegex(output, r"not run: 6 shards of mhz25: no worker is willing; .* The hash of set ")
            process = self.begin_remote(remote.address)
            wait_for(lambda: "It waits 55 s more." in process.stdout.readline(), "the notice")
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
        kept = self.other / PROGRAMS / "kept" / "0"
        kept.mkdir(parents=True)
        sets = json.loads((ROOT / PROGRAMS / "sets.json").read_text())
        sets["sets"][SET]["hash"] = "0" * 32
        (kept / "sets.json").write_text(json.dumps(sets))
        file = self.folder / "scheduler.json"
        self.scheduler = self._start(
            ROOT, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)
        )
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

    def _start(self, cwd, *arguments, package=ROOT / "src"):
        process = subprocess.Popen(
            [str(Path(sys.executable).parent / "dask"), *arguments, "--no-dashboard"], cwd=cwd,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(package)},
        )
        self.processes.append(process)
        return process

    def package(self, code):
        """Where a package of campaigns is that has this code, too, in what its workers run."""
        where = Path(tempfile.mkdtemp(dir=self.folder))
        shutil.copytree(ROOT / "src" / "campaign", where / "campaign")
        with open(where / "campaign" / "runner.py", "a") as file:
            file.write(textwrap.dedent(code))
        return where

    def start_worker(self, cwd, package=ROOT / "src"):
        # Without a nanny the process is the worker itself, which a test may kill.
        return self._start(
            cwd, "worker", self.address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny",
            "--local-directory", str(self.folder), package=package,
        )

    def wait_for_workers(self, count):
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=40)


def tests(suite):
    """Names of all tests below `suite`, as arguments of this program."""
    for test in suite:
        if isinstance(test, unittest.TestSuite):
            yield from tests(test)
        else:
            yield test.id().removeprefix("__main__.")


def in_parallel(processes):
    """Runs all tests in so many processes: they wait more than they work."""
    names = list(tests(unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])))
    # The tests of a class stand together and take about the same time, so each process gets some of each.
    parts = [names[n::processes] for n in range(processes)]
    running = [subprocess.Popen([sys.executable, __file__, "-v", *part]) for part in parts]
    return max(process.wait() for process in running)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--processes"]:
        sys.exit(in_parallel(int(sys.argv[2])))
    unittest.main()
