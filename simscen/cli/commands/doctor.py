"""Command `simscen doctor`, which checks the installation."""

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
from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.installation import CheckFailed
from simscen.cli.process import caller_environment, config_file, engine_output_on_stderr
from simscen.core.errors import Exit, InvalidInput, SimscenError

_SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""

RESULT_COLUMN = 15
"""Column in which the result of a check begins."""
MIN_REAL_TIME_FACTOR = 1.0
"""Minimum number of simulated seconds per second of CPU time."""

Check = tuple[str, Callable[[], str]]
"""Name of a check, and its function, which returns the result as text, or raises CheckFailed."""


def command() -> None:
    """Check that this installation can run scenarios.

    Checks Python, the packages and their versions, Linux features, limits of memory and files, disk space, the cache of
    maps and shortest paths, and the external stacks in your configuration. Then runs one simulated second twice,
    compares the logs, and measures how fast a drive through a hall is simulated. For each failed check, it prints what
    to do.

    Exit code 0: all checks passed; 3: a check failed.
    """
    passed = True
    width = max(40, shutil.get_terminal_size((80, 24)).columns)
    for name, check in checks():
        try:
            sign, result = "✓", check()
        except CheckFailed as failure:
            passed, sign, result = False, "✗", str(failure)
        except Exception as error:  # such as a library that the physics engine needs, but that cannot be loaded
            passed, sign, result = False, "✗", f"{type(error).__name__}: {error}"
        indents = f"  {sign} {name:10} ", " " * RESULT_COLUMN
        wrapper = textwrap.TextWrapper(width, *indents, break_long_words=False, break_on_hyphens=False)
        print_text(wrapper.fill(escaped(result)))
        sys.stdout.flush()
    sys.exit(Exit.PASSED if passed else Exit.INCOMPLETE)


def checks() -> Iterator[Check]:
    """Yield all checks in the order in which they run."""
    yield "python", installation.check_python
    yield "packages", installation.check_packages
    yield "processor", installation.describe_processor
    yield "fork", installation.check_fork
    yield "pidfd", installation.check_pidfd
    yield "limits", installation.check_resource_limits
    yield "/dev/shm", installation.check_shared_memory
    yield "tmp", installation.check_temporary_folder
    yield "disk", partial(installation.check_disk_space, Path.cwd())
    yield "cache", check_cache
    yield "stacks", check_stacks
    yield "run", check_run
    yield "speed", check_speed


def check_cache() -> str:
    """Check that only the user can write the cache of maps and shortest paths, and return its folder and size."""
    from simscen.run.disk_cache import (
        CACHE_DIR_VARIABLE,
        MAX_CACHE_BYTES,
        cache_folder,
        disk_usage,
        is_private_folder,
    )

    folder = cache_folder(os.environ)
    if folder is None:
        return f"disabled by {CACHE_DIR_VARIABLE}"
    if not folder.exists():
        return f"{folder}: empty"
    if not is_private_folder(folder):
        reason = f"{folder} is not used: it does not belong to you, or other users may write to it"
        raise CheckFailed(f"{reason}; delete it, or set {CACHE_DIR_VARIABLE} to another folder")
    count, size = disk_usage(folder)
    return f"{folder}: {count} files, {size / 1e6:.1f} MB of at most {MAX_CACHE_BYTES / 1e6:.0f}; safe to delete"


def check_stacks() -> str:
    """Check that the user's configuration is valid, and return the commands of its external stacks."""
    from simscen.loading.stacks.userconfig import load_config

    try:
        config = load_config(config_file())
        commands = {name: config.command(name, caller_environment(), Path.cwd()) for name in config.spec.stacks}
    except InvalidInput as error:
        raise CheckFailed(str(error)) from error
    if config.tree is None:
        return f"{config.file} does not exist; define external stacks with --stack"
    stack_list = ", ".join(f"{name} = {shlex.join(command.argv)}" for name, command in commands.items() if command)
    return f"{config.file}: {stack_list or 'no stacks'}"


def check_speed() -> str:
    """Check that a patrol runs faster than real time, and return its speed."""
    with engine_output_on_stderr():
        from simscen.bench.speed import run_speed

        patrol = run_speed.measure_patrol(1)
    ratio = f"{patrol.cpu / patrol.baseline:.1f} times the cost of PyBullet alone"
    result = f"{patrol.real_time_factor:.0f} times real time on one core, {ratio}"
    if patrol.real_time_factor < MIN_REAL_TIME_FACTOR:
        raise CheckFailed(f"{result}; use a faster processor, or one that is not shared with other containers")
    return result


def check_run() -> str:
    """Check that two runs of one simulated second pass with equal logs, and return the hash of the log."""
    from simscen.cli.session.backends import backend_of, interrupt_on_signals
    from simscen.core.records.run_result import Outcome
    from simscen.loading.scenario import load_scenario
    from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session

    with tempfile.TemporaryDirectory(prefix="simscen-doctor-") as name:
        folder = Path(name).resolve()
        (folder / "doctor.scenario.yaml").write_text(_SCENARIO, encoding="utf-8")
        options = SessionOptions(workers=2, check_determinism=True, wall_limit=60.0)
        try:
            jobs = plan_jobs([load_scenario(folder / "doctor.scenario.yaml", folder)], options, folder / "out")
            with interrupt_on_signals(), backend_of(options) as backend:
                finished_runs, stopped = run_session(jobs, options, backend, lambda _: None)
        except SimscenError as error:
            raise CheckFailed(str(error)) from error
        if stopped is not None:
            sys.exit(stopped)
        for finished in finished_runs:
            if finished.outcome is not Outcome.PASSED:
                failure = finished.result.error
                raise CheckFailed(failure.message if failure else "the robot collided in an empty room")
        log = Path(finished_runs[0].artifacts.mcap).read_bytes()
    return f"1 s simulated twice, equal logs: sha256 {hashlib.sha256(log).hexdigest()[:16]}"
