"""Where things that can be pushed are at home: where they lie, for good mostly."""

from collections.abc import Mapping

from simscen.core.geometry import Pose3


class Homes:
    """By name, the `poses` in which things lay at two looks in a row, or at the first."""

    def __init__(self) -> None:
        self.poses: Mapping[str, Pose3] = {}
        """Another mapping whenever one of them is another."""
        self._lay: Mapping[str, Pose3] | None = None

    def look(self, lie: Mapping[str, Pose3]) -> None:
        """See how everything lies that can be pushed.

        What has left its home, or is gone, keeps it for when it is there again to the last bit.
        """
        before, self._lay = lie if self._lay is None else self._lay, lie
        come = {name: pose for name, pose in lie.items() if before.get(name) == pose != self.poses.get(name)}
        if come:
            self.poses = {**self.poses, **come}
