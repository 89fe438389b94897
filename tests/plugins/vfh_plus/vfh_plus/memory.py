"""Obstacles that the lidars have detected recently, as cells in the map frame."""

import numpy as np

from simscen.plugin import Array, Pose2, Scan

EDGE = 0.05


class Memory:
    """Cells in which something was seen, each with the tick of the newest scan that saw it."""

    def __init__(self, ticks: int, reach: float) -> None:
        self._ticks, self._reach = ticks, reach
        self._seen: dict[tuple[int, int], int] = {}

    def add(self, scan: Scan, pose: Pose2) -> None:
        """Take the hits of a scan that are within reach."""
        points = scan.points()
        near = points[np.hypot(*points.T) < self._reach] if len(points) else points
        for row in np.unique(np.floor(pose.apply(near) / EDGE).astype(np.int64), axis=0).tolist():
            self._seen[row[0], row[1]] = scan.tick

    def obstacles(self, tick: int) -> Array:
        """Middles (n, 2) of the cells that are still remembered, in the map frame."""
        self._seen = {cell: at for cell, at in self._seen.items() if tick - at <= self._ticks}
        return (np.array(sorted(self._seen), dtype=np.float64).reshape(-1, 2) + 0.5) * EDGE
