"""`simscen doctor`."""

import hashlib
import os
import shlex
import shutil
import sys
import tempfile
import textwrap
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from simscen.cli import installation
from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.installation import Ill
from simscen.core.errors import Exit, InvalidInput, SimscenError

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""

INDENT = 15
SLOWEST = 1.0
"""Times real time: below that, campaigns take longer than the drives they stand for."""

Check = tuple[str, Callable[[], str]]


def command() -> None:
    """Check that this installation can run scenarios.

    Python, packages and their versions, what Linux must offer, limits of memory and files, room on the disk; where
    worlds are cached; one second of a real run, twice, whose logs must be equal; and the speed of a patrol, beside
    PyBullet alone. Also what your own configuration says that the names of external stacks run, and whether these
    programs are there. What is not well is told with what helps. Exit code 0: all is well; 3: something is not.
    """
    well = True
    for name, check in checks():
        try:
            sign, told = "✓", check()
        except Ill as ill:
            well, sign, told = False, "✗", str(ill)
        print_text(_line(sign, name, harmless(told)))
        sys.stdout.flush()
    sys.exit(Exit.PASSED if well else Exit.INCOMPLETE)


def checks() -> Iterator[Check]:
    """Name and check, in the order in which they are done; a check returns what it found or raises Ill."""
    yield "python", installation.python
    yield "packages", installation.packages
    yield "processor", installation.processor
    yield "fork", installation.fork
    yield "pidfd", installation.pidfd
    yield "limits", installation.limits
    yield "shared", installation.shared_memory
    yield "temporary", partial(installation.writable, Path(tempfile.gettempdir()))
    yield "here", partial(installation.room, Path.cwd())
    yield "cache", cache
    yield "stacks", stacks
    yield "run", run_twice
    yield "speed", speed


def _line(sign: str, name: str, told: str) -> str:
    """One check within the width of the terminal."""
    width = max(40, shutil.get_terminal_size((80, 24)).columns)
    first = f"  {sign} {name:10} "
    wrapper = textwrap.TextWrapper(width, first, " " * INDENT, break_long_words=False, break_on_hyphens=False)
    return wrapper.fill(told)


def cache() -> str:
    """Where maps and shortest ways of worlds are kept between sessions, and how much of them."""
    from simscen.run.keptfiles import MOST_BYTES, VARIABLE, cache_folder, is_own, used

    folder = cache_folder(os.environ)
    if folder is None:
        return f"nothing is kept between sessions ({VARIABLE})"
    if not folder.exists():
        return f"{folder}: nothing there yet"
    if not is_own(folder):
        told = f"{folder} is not used: it is no folder of yours, or others may write to it"
        raise Ill(f"{told}; delete it, or name another with {VARIABLE}")
    count, size = used(folder)
    return f"{folder}: {count} files, {size / 1e6:.1f} MB of at most {MOST_BYTES / 1e6:.0f}; to be deleted at any time"


def stacks() -> str:
    """What the names of external stacks run, by the user's own configuration."""
    from simscen.cli.process import config_file, environment
    from simscen.loading.stacks.userconfig import load_config

    try:
        config = load_config(config_file())
        commands = {name: config.command(name, environment(), Path.cwd()) for name in config.spec.stacks}
    except InvalidInput as error:
        raise Ill(str(error)) from error
    if config.tree is None:
        return f"no {config.file}, so --stack alone says what external stacks run"
    told = ", ".join(f"{name} = {shlex.join(command.argv)}" for name, command in commands.items() if command)
    return f"{config.file}: {told or 'no stacks'}"


def speed() -> str:
    """A patrol with everything on, beside PyBullet alone: what differs from other machines is the processor's share."""
    from simscen.cli.process import engine_output_on_stderr

    with engine_output_on_stderr():
        from simscen.bench.speed import run_speed

        patrol = run_speed.measure_patrol(1)
    ratio = f"{patrol.cpu / patrol.bare:.1f} times what PyBullet alone takes"
    told = f"{patrol.factor:.0f} times real time on one core, {ratio}"
    if patrol.factor < SLOWEST:
        raise Ill(f"{told}; use a faster processor, or one that other containers leave alone")
    return told


def run_twice() -> str:
    """A second of a real run passes, and its log is the same when it is run again."""
    from simscen.cli.session.run_session import WARM_PROCESS
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
