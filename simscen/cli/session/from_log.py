"""Implementation of `simscen new --from-log`, which reconstructs a scenario from a recorded drive."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.cli.diagnostics import escaped, print_text, relative_to_working_folder
from simscen.cli.session.user_files import create_file
from simscen.cli.shared_options import parse_topics
from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.discovery import default_root

if TYPE_CHECKING:
    from simscen.reconstruction.scenario_from_log import Reconstruction


@dataclass(frozen=True)
class FromLogOptions:
    """Options of `simscen new --from-log`.

    log:     recorded drive: an MCAP file or a rosbag2 folder
    out:     scenario file to write
    map:     map of the robot; None for the map in the log
    world:   world file; None for a world made from the log
    robot:   robot model or file; "" for the robot in the log
    truth:   topic of the true pose; "none" to ignore it; None for the topic of simscen's own logs
    topics:  entries NAME=TOPIC for messages whose topic in the log is not the default, such as scan=/front/scan
    root:    folder of the files that the recorded scenario refers to; None for the working folder
    """

    log: Path
    out: Path
    map: Path | None = None
    world: Path | None = None
    robot: str = ""
    truth: str | None = None
    topics: list[str] = field(default_factory=list)
    root: Path | None = None


def write_scenario_from_log(options: FromLogOptions, verify: bool) -> None:
    """Write the scenario and print a summary. With `verify`, also run the scenario, and compare the run with the log.

    Raises InvalidInput if the log or another file is unusable, and UsageError if the scenario cannot be written.
    """
    if not options.log.exists():
        raise InvalidInput([Problem(str(options.log), 0, 0, "SC001", "no such file or directory")])
    made = _reconstruct(options)
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


def _reconstruct(options: FromLogOptions) -> Reconstruction:
    from simscen.reconstruction.drive.log_messages import TOPIC_ROLES
    from simscen.reconstruction.scenario.given_parts import GivenFiles
    from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log

    renamed, files = parse_topics(options.topics, TOPIC_ROLES), GivenFiles(options.world, options.map, options.robot)
    reading_options = ReconstructionOptions(options.truth, renamed, files, options.root)
    with create_file(options.out, str(options.out)):
        try:
            return scenario_from_log(options.log, options.out, reading_options)
        except InvalidInput as error:
            raise InvalidInput(relative_to_working_folder(error.problems, default_root([options.out]))) from error
