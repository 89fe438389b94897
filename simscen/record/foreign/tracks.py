"""Where something was over time, as one topic or tf tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.trace import Ticks
from simscen.record.foreign.collected import Collected
from simscen.record.foreign.frames import Transforms
from simscen.record.foreign.messages import NO_COVARIANCE, Posed
from simscen.record.foreign.timebase import Stamped
from simscen.record.foreign.unusable import Unusable
from simscen.record.foreign.wanted import Wanted


@dataclass(frozen=True, eq=False)
class Track:
    """Poses (n, 7) in `frame`, in the order they were logged, with covariances (n, 6) and perhaps twists (n, 3)."""

    source: str
    frame: str
    logged: Ticks
    stamped: Stamped | None
    poses: Array
    covariances: Array
    twists: Array | None


def stamped(topic: str, logged: Sequence[int], stamps: Sequence[int], wanted: Wanted) -> Stamped | None:
    """The stamps of a topic's messages by the time of logging; None where they are not to be used, or never set."""
    if wanted.clock == "log" or not any(stamps):
        return None
    times = np.array(logged, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    return Stamped(topic, times[order], np.array(stamps, dtype=np.int64)[order])


def track_of(topic: str, said: Sequence[tuple[int, Posed]], wanted: Wanted) -> Track:
    """The track that a topic's messages make. Raises Unusable when they are told in several frames."""
    frames = sorted({posed.frame for _, posed in said})
    if len(frames) > 1:
        raise Unusable(f"{topic} is told in several frames: {', '.join(frames)}")
    said = sorted(said, key=lambda one: one[0])
    logged = [time for time, _ in said]
    twists = [posed.twist for _, posed in said if posed.twist is not None]
    return Track(
        topic,
        frames[0],
        np.array(logged, dtype=np.int64),
        stamped(topic, logged, [posed.stamp for _, posed in said], wanted),
        np.array([posed.pose for _, posed in said]),
        np.array([posed.covariance for _, posed in said]),
        np.array(twists) if len(twists) == len(said) else None,
    )


def track_of_tf(outer: str, inner: str, found: Collected, wanted: Wanted) -> Track | str:
    """The track that tf makes of the frame `inner` in `outer`; or why there is none."""
    tree = Transforms()
    for role in ("tf_static", "tf"):
        for logged, links in found.said[role]:
            tree.add(logged, links, static=role == "tf_static")
    between = tree.between(outer, inner)
    if isinstance(between, str):
        return between
    told, poses = between
    covariances = np.tile(NO_COVARIANCE, (len(poses), 1))
    by_stamp = None if wanted.clock == "log" or not told.stamps.any() else told
    return Track(told.topic, outer, told.logged, by_stamp, poses, covariances, None)
