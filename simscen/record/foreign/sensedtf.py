"""What /tf tells of a drive: where one frame is in another, as messages of a topic would."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from simscen.record.foreign.frames import Transforms
from simscen.record.foreign.messages import Posed
from simscen.record.foreign.unusable import Unusable

Said = tuple[int, int, Any]
"""When a message was logged in ns, its place in the log, and what it says."""


def frames_of(name: str) -> tuple[str, str] | None:
    """The two frames of `map:base_link`, outer first; None for the name of a topic."""
    outer, colon, inner = name.partition(":")
    return (outer, inner) if colon and not name.startswith("/") else None


@dataclass
class HeardTf:
    """The transforms of a log, and its messages by when they were logged."""

    transforms: Transforms = field(default_factory=Transforms)
    orders: dict[int, int] = field(default_factory=dict)

    def add(self, logged: int, order: int, links: list[Posed], static: bool) -> None:
        """Take in one message."""
        self.transforms.add(logged, links, static)
        self.orders[logged] = order

    def between(self, outer: str, inner: str) -> list[Said]:
        """Where `inner` was in `outer`. Raises Unusable where nothing tells."""
        found = self.transforms.between(outer, inner)
        if isinstance(found, str):
            raise Unusable(found)
        times, poses = found
        return [
            (logged, self.orders[logged], Posed(stamp, outer, tuple(pose), child=inner))
            for logged, stamp, pose in zip(times.logged.tolist(), times.stamps.tolist(), poses.tolist(), strict=True)
        ]
