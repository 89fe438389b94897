"""`simscen doctor`."""

import hashlib
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from simscen.cli.diagnostics import harmless, print_text
from simscen.core.errors import Exit, SimscenError
from simscen.run.versions import PACKAGES, cpu_flags

PYTHONS = ((3, 10), (3, 11))
LEAST_FREE = 500 << 20
"""Bytes: some hundred logs of a minute each."""

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""


class Ill(Exception):
    """Why a check does not hold, and what would help."""


Check = tuple[str, Callable[[], str]]


def command() -> None:
    """Check that this installation can run scenarios.

    Python, packages, what Linux must offer, room on the disk, and one second of a real run, twice, whose logs must be
    equal. Exit code 0: all is well; 3: something is not.
    """
    well = True
    for name, check in checks():
        try:
            sign, told = "✓", check()
        except Ill as ill:
            well, sign, told = False, "✗", str(ill)
        print_text(f"  {sign} {name:10} {harmless(told)}")
        sys.stdout.flush()
    sys.exit(Exit.PASSED if well else Exit.INCOMPLETE)


def checks() -> Iterator[Check]:
    """Name and check, in the order in which they are done; a check returns what it found or raises Ill."""
    yield "python", python
    yield from ((name, partial(package, name)) for name in PACKAGES)
    yield "processor", processor
    yield "fork", fork
    yield "pidfd", pidfd
    yield "temporary", partial(writable, Path(tempfile.gettempdir()))
    yield "here", partial(room, Path.cwd())
    yield "run", run_twice


def python() -> str:
    """The version of Python is one that pybullet and ompl have wheels for."""
    if sys.version_info[:2] not in PYTHONS:
        raise Ill(f"{platform.python_version()}: simscen needs 3.10 or 3.11, which pybullet and ompl have wheels for")
    return f"{platform.python_version()} ({sys.executable})"


def package(name: str) -> str:
    """A package is installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        raise Ill(f"not installed: pip install {name}") from None


def processor() -> str:
    """What logs may differ by in their last bits: never ill."""
    return f"{platform.machine()}, {len(os.sched_getaffinity(0))} cores, {' '.join(cpu_flags()) or 'flags unknown'}"


def fork() -> str:
    """Runs are forked from a warm process."""
    if sys.platform != "linux":
        raise Ill(f"{sys.platform}: runs are supervised with means that only Linux has")
    child = os.fork()
    if child == 0:
        os._exit(7)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 7:
        raise Ill("a forked process did not end as it should")
    return "processes can be forked"


def pidfd() -> str:
    """The supervisor waits for processes by file descriptors."""
    try:
        os.close(os.pidfd_open(os.getpid()))
    except (AttributeError, OSError) as error:
        raise Ill(f"pidfd_open: {error}; Linux 5.3 or newer is needed, and a sandbox that allows it") from None
    return f"Linux {platform.release()}"


def writable(folder: Path) -> str:
    """Something can be written in a folder."""
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"simscen")
            file.flush()
    except OSError as error:
        raise Ill(f"cannot write in {folder}: {error.strerror}") from None
    return f"{folder} is writable"


def room(folder: Path) -> str:
    """There is room for some logs where simscen-out would be."""
    told = writable(folder)
    free = shutil.disk_usage(folder).free
    if free < LEAST_FREE:
        raise Ill(f"only {free / 2**20:.0f} MiB are free in {folder}; a run of a minute writes some 5 MiB")
    return f"{told}, {free / 2**30:.1f} GiB free"


def run_twice() -> str:
    """A second of a real run passes, and its log is the same when it is run again."""
    from simscen.cli.run import WARM_PROCESS
    from simscen.core.result import Outcome
    from simscen.loading.scenario import load_scenario
    from simscen.run.session import Options, plan, run_session

    with tempfile.TemporaryDirectory(prefix="simscen-doctor-") as name:
        folder = Path(name).resolve()
        (folder / "doctor.scenario.yaml").write_text(SCENARIO, encoding="utf-8")
        options = Options(workers=2, twice=True, wall_limit=60.0)
        try:
            jobs = plan([load_scenario(folder / "doctor.scenario.yaml", folder)], options, folder / "out")
            answers, _ = run_session(jobs, options, WARM_PROCESS, lambda _: None)
        except SimscenError as error:
            raise Ill(str(error)) from error
        for answer in answers:
            if answer.outcome is not Outcome.PASSED:
                broken = answer.result.error
                raise Ill(broken.message if broken else "a robot in an empty room hit something")
        log = Path(answers[0].artifacts.mcap).read_bytes()
    return f"1 s simulated twice, equal logs: sha256 {hashlib.sha256(log).hexdigest()[:16]}"
