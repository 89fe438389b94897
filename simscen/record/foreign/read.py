"""Reads a log of others into a Trace, and says what it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import LogCoverage
from simscen.record.foreign.bagfolder import messages_of
from simscen.record.foreign.collected import collect, roles_of
from simscen.record.foreign.reading import Reading
from simscen.record.foreign.tosee import TOPICS_TO_SEE, Watched
from simscen.record.foreign.unusable import Unusable
from simscen.record.foreign.wanted import Wanted
from simscen.record.replay import DAMAGE, invalid
from simscen.record.seen import Seen


@dataclass(frozen=True, eq=False)
class ForeignLog:
    """A log of others: its trace, what it lacks, and what about it is odd, in words for its owner.

    `seen` and `map` are what no trace holds; nothing unless it was asked for.
    """

    trace: Trace
    coverage: LogCoverage
    notes: Sequence[str]
    seen: Seen = field(default_factory=Seen)
    map: OccupancyGrid | None = None


def read_foreign(path: Path, wanted: Wanted, looks: bool = False) -> ForeignLog:
    """Read an MCAP file or a rosbag2 folder of a real robot.

    The trace lasts from the first to the last message that is wanted. One that was cut off has no `run.ended`, so that
    nothing passes on it. With `looks`, scans, particles, local plans, costmaps and the map are kept, too. Raises
    InvalidInput, with the reason, for what cannot be used.
    """
    try:
        roles = roles_of(wanted)
        watched = Watched() if looks else None
        messages = messages_of(path, (*roles, *TOPICS_TO_SEE) if looks else roles)
        found = collect(messages if watched is None else watched.among(messages), roles)
        with np.errstate(all="ignore"):  # what is not finite is found and named by whoever judges it
            reading = Reading(found, messages.topics, wanted)
        end = reading.time.end
        if messages.complete:
            reading.rows.events.append(Event(end, EventKind.RUN_ENDED, "the recording ends"))
        else:
            reading.notes.append("the log breaks off, so nothing passes on it")
        trace = reading.rows.trace(wanted.tick_rate, end)
        coverage = LogCoverage(reading.missing, reading.partial, recorded_by_simscen=False)
        if watched is None:
            return ForeignLog(trace, coverage, reading.notes)
        return ForeignLog(trace, coverage, reading.notes, watched.seen(reading.time, found), watched.map)
    except Unusable as error:
        raise invalid(path, "SC804", str(error), error.hint) from error
    except OSError as error:
        raise invalid(path, "SC800", f"cannot read the log: {error.strerror or error}") from error
    except DAMAGE as error:
        raise invalid(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error
