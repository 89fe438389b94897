"""Transforms whose poses were worked out ahead, laid out by numpy for all moments at once."""

from collections.abc import Sequence
from struct import calcsize

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.record.cdr import Template
from simscen.record.simtime import Stamp

Bytes = npt.NDArray[np.uint8]


class TransformsAhead:
    """What stands behind the first transform of a tf2_msgs/msg/TFMessage, for links that are always the same."""

    def __init__(self, links: Sequence[tuple[str, str]]) -> None:
        """Each link is (frame, child frame)."""
        # A transform ends on a multiple of eight bytes, so that these begin on one.
        message = Template(prefix=b"")
        self._places = list[tuple[slice, slice]]()
        for frame, child in links:
            stamp = _room(message, "iI")
            message.string(frame)
            message.string(child)
            self._places.append((stamp, _room(message, "7d")))
        self._empty = np.frombuffer(message.buffer, np.uint8)
        self.size = len(self._empty)
        """Bytes of a moment."""

    def __call__(self, stamps: Sequence[Stamp], poses: Array) -> Bytes:
        """(n, size) bytes of n moments; `poses` (n, links, 7) are those of the children in their frames."""
        packed = np.tile(self._empty, (len(poses), 1))
        times, numbers = np.array(stamps, "<u4").view(np.uint8), np.ascontiguousarray(poses, "<f8").view(np.uint8)
        for column, (stamp, pose) in enumerate(self._places):
            packed[:, stamp], packed[:, pose] = times, numbers[:, column]
        return packed


def _room(message: Template, codes: str) -> slice:
    """Where in a message some numbers stand that come next."""
    message.slot(codes, "*numbers")
    end = len(message.buffer)
    return slice(end - calcsize(f"<{codes}"), end)
