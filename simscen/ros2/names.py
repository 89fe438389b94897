"""What the topics of the protocol are called in the user's graph: namespace and remappings, as ROS has them."""

from typing import Dict, Iterable

from simscen.ros2.failure import Failure

GLOBAL = ("/clock",)
"""Topics that no namespace moves: nodes of all namespaces hear the same time."""


class Names:
    """Topic of the protocol → topic of the graph.

    A remapping says `/scan:=/front/scan`; a target without a slash in front is taken in the namespace, and so is every
    topic that no remapping names, but /clock.
    """

    def __init__(self, namespace: str, remappings: Iterable[str]) -> None:
        self.namespace = "/" + namespace.strip("/") if namespace.strip("/") else ""
        self._remapped: Dict[str, str] = {}
        for text in remappings:
            source, between, target = text.partition(":=")
            if not between or not source or not target:
                raise Failure(f"--remap {text}: not of the form /from:=/to")
            self._remapped["/" + source.lstrip("/")] = target

    def __call__(self, topic: str) -> str:
        """The name of `topic`, which begins with a slash, in the graph."""
        target = self._remapped.get(topic)
        if target is None:
            return topic if topic in GLOBAL else self.namespace + topic
        return target if target.startswith("/") else f"{self.namespace}/{target}"
