"""Reconstruction of a scenario from a log for `simscen new --from-log`."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.cli.diagnostics import escaped, from_here, print_text
from simscen.cli.log_options import parse_topics
from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.loading.files.discovery import default_root
from simscen.loading.yaml.textfile import os_error_reason

if TYPE_CHECKING:
    from simscen.reconstruction.scenario_from_log import Reconstruction


@dataclass(frozen=True)
class FromLogOptions:
    """Options of `simscen new --from-log`; `out` is the scenario to write."""

    log: Path
    out: Path
    map: Path | None = None
    world: Path | None = None
    robot: str = ""
    truth: str | None = None
    topics: list[str] = field(default_factory=list)
    root: Path | None = None


def write_scenario_from_log(options: FromLogOptions, verify: bool) -> None:
    """Write the scenario, print what it holds, and verify it if wanted. Raises InvalidInput and UsageError."""
    if not options.log.exists():
        raise InvalidInput([Problem(str(options.log), 0, 0, "SC001", "no such file or directory")])
    made = _reconstructed(options)
    for file in made.files[1:]:
        print_text(f"wrote {escaped(str(file))}")
    for line in made.summary():
        print_text(escaped(line))
    name = escaped(str(options.out))
    print_text(f"wrote {name}; try: simscen run {name}")
    for unknown in made.contents.unknowns:
        print_text(f"note: the log does not show: {escaped(unknown)}", sys.stderr)
    if verify:
        from simscen.cli.session.verification import verify_reconstruction

        verify_reconstruction(made)


def _reconstructed(options: FromLogOptions) -> Reconstruction:
    from simscen.reconstruction.drive.log_messages import TOPIC_ROLES
    from simscen.reconstruction.drive.reader import DriveOptions
    from simscen.reconstruction.scenario.given_parts import GivenFiles
    from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log

    drive = DriveOptions(options.truth, parse_topics(options.topics, TOPIC_ROLES))
    wanted = ReconstructionOptions(drive, GivenFiles(options.world, options.map, options.robot), options.root)
    out = options.out
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.open("x").close()
    except FileExistsError:
        raise UsageError(f"{out} already exists; choose another name") from None
    except (OSError, ValueError) as error:
        why = os_error_reason(error) if isinstance(error, OSError) else "the name cannot be a path"
        raise UsageError(f"cannot write {str(out)!r}: {why}") from None
    try:
        return scenario_from_log(options.log, out, wanted)
    except InvalidInput as error:
        out.unlink(missing_ok=True)
        raise InvalidInput(from_here(error.problems, default_root([out]))) from error
    except OSError as error:
        out.unlink(missing_ok=True)
        raise UsageError(f"cannot write {str(out)!r}: {os_error_reason(error)}") from None
    except BaseException:
        out.unlink(missing_ok=True)
        raise
