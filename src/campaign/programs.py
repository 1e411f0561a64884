"""Programs kept by content: those of a running campaign stay what they were, whatever is built meanwhile.

`flyframe.campaign.Programs` builds into a folder; what a campaign runs is copied from there to `kept/DIGEST`
below it, and never changed. Whoever uses a kept folder holds a shared lock on its file `lock`. Needs only the
standard library; as a program it builds and keeps, which is what `make campaign-programs` does.
"""

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

from campaign.shard import Parser, Refused, built, built_sets

# Kept programs that nobody holds and nobody has used for so many seconds are deleted at the next build. A
# worker holds them only while it runs a shard, so this must be longer than any pause between two shards.
UNUSED = 24 * 3600


def _kept(programs):
    return Path(programs) / "kept"


def _files(programs):
    """Paths, relative to `programs`, of all that a shard needs."""
    jars = [f"jars/{jar}" for jar in built(programs)["jars"]]
    return ["sets.json", "flyframe-fuzz", "flyframe-smsoak", "flyframe-faults", *jars]


def _digest(programs):
    digest = hashlib.sha256()
    for name in sorted(_files(programs)):
        content = (Path(programs) / name).read_bytes()
        digest.update(f"{name} {len(content)} ".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


@contextmanager
def _held(folder):
    """Holds the kept `folder` for use; yields False if it has been deleted meanwhile."""
    try:
        lock = open(folder / "lock", "r+")
    except FileNotFoundError:
        yield False
        return
    with lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        if os.fstat(lock.fileno()).st_nlink == 0:
            yield False
            return
        os.utime(lock.fileno())
        try:
            yield True
        finally:
            os.utime(lock.fileno())


def _copy(programs):
    """The folder with these programs by content; made if it does not exist, and then whole from the start."""
    folder = _kept(programs) / _digest(programs)
    if not folder.exists():
        folder.parent.mkdir(exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=".new-", dir=folder.parent))
        try:
            (fresh / "jars").mkdir()
            for name in _files(programs):
                shutil.copy2(Path(programs) / name, fresh / name)
            (fresh / "lock").touch()
            fresh.chmod(0o755)
            fresh.rename(folder)
        except BaseException:
            shutil.rmtree(fresh, ignore_errors=True)
            raise
    return folder


def prune(programs):
    """Deletes kept programs that no campaign in progress uses, and jars of earlier builds.

    Only for whoever holds the lock of builds.
    """
    for folder in _kept(programs).iterdir():
        if folder.name.startswith("."):  # what an interrupted copy or deletion has left
            shutil.rmtree(folder, ignore_errors=True)
            continue
        try:
            lock = open(folder / "lock")
        except FileNotFoundError:  # not one of ours
            continue
        with lock:
            if time.time() - os.fstat(lock.fileno()).st_mtime < UNUSED:
                continue
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            gone = folder.with_name(f".old-{folder.name}")
            folder.rename(gone)
            shutil.rmtree(gone, ignore_errors=True)
    named = built(programs)["jars"]
    for jar in (Path(programs) / "jars").iterdir():
        if jar.name not in named:
            jar.unlink()


def _build(programs, command, lock):
    # An interrupted build must not leave the description of another one.
    (Path(programs) / "sets.json").unlink(missing_ok=True)
    # The build has the lock too, so that it keeps it if it outlives this process.
    code = subprocess.run(command, shell=True, pass_fds=[lock.fileno()]).returncode
    if code != 0:
        raise Refused(f"The programs could not be built: the build ended with exit code {code}.")


@contextmanager
def kept(programs, build=None, say=print):
    """Builds the programs with the command `build`, if any, and holds the folder in which they are kept."""
    programs = Path(programs)
    if build:
        programs.mkdir(parents=True, exist_ok=True)
    else:
        built(programs)  # says so if there is nothing to keep
    with ExitStack() as use:
        with open(programs / "lock", "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                say(f"Programs are being built in {programs}; waiting until that has ended.")
                fcntl.flock(lock, fcntl.LOCK_EX)
            if build:
                _build(programs, build, lock)
            try:
                folder = _copy(programs)
            except FileNotFoundError as missing:
                raise Refused(f"{missing.filename} is missing; make campaign-programs builds it.") from None
            use.enter_context(_held(folder))  # there it is, as only the holder of the lock deletes
            prune(programs)
        yield folder


def _has(folder, set_, hash_):
    try:
        return built_sets(folder).get(set_, {}).get("hash") == hash_
    except Refused:  # deleted meanwhile
        return False


def _folders(programs):
    """Those kept, the newest first."""

    def made(folder):
        try:
            return folder.stat().st_ctime_ns
        except FileNotFoundError:  # deleted meanwhile
            return 0

    return sorted(_kept(programs).glob("[!.]*"), key=made, reverse=True)


def find(programs, set_, hash_, first=None):
    """The kept folders in which a set has this hash, before the others the one called `first`.

    Raises Refused if there is none.
    """
    folders = _folders(programs)
    if not folders:
        raise Refused(f"No programs are built in {programs}; make campaign-programs builds them.")
    right = [folder for folder in folders if _has(folder, set_, hash_)]
    if right:
        return sorted(right, key=lambda folder: folder.name != first)
    for folder in folders:
        try:
            other = built_sets(folder)[set_]["hash"]
        except (Refused, KeyError):
            continue
        raise Refused(f"The hash of set {set_} is {other} in {programs} but must be {hash_}.")
    raise Refused(f"The set {set_} is not built in {programs}; make campaign-programs SETS={set_} builds it.")


@contextmanager
def using(programs, set_, hash_, first=None):
    """Holds the first folder that `find` finds."""
    for folder in find(programs, set_, hash_, first):
        with _held(folder) as there:
            if there:
                yield folder
                return
    find(programs, set_, hash_)  # says what is there now
    raise Refused(f"The programs of set {set_} in {programs} were deleted at this moment.")


def main(arguments=None):
    parser = Parser(prog="campaign-programs", description="Builds the programs of campaigns and keeps them.")
    parser.add_argument("programs", help="folder into which the command builds")
    parser.add_argument("build", help="the command, for a shell")
    options = parser.parse_args(arguments)
    try:
        with kept(options.programs, options.build) as folder:
            print(f"The programs are kept in {folder}.")
    except (Refused, OSError) as problem:
        print(f"campaign-programs: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("campaign-programs: interrupted.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
