"""Options of `simscen ros2`, the error that ends a run, and the names of topics in the user's graph."""

from typing import Any, Dict, Iterable, List, NamedTuple, Optional


class AdapterError(Exception):
    """The run cannot continue; the message says what is wrong and what to do."""


class Options(NamedTuple):
    """Options as `simscen ros2 --help` explains them; times in seconds."""

    launch: Optional[str] = None
    domain: Optional[int] = None
    namespace: str = ""
    remap: List[str] = []
    without: List[str] = []
    goals: str = "auto"
    base_frame: Optional[str] = None
    sync: str = "lockstep"
    factor: float = 1.0
    rounds: int = 0
    wait: float = 0.05
    warm_up: float = 0.0
    ready: float = 20.0
    settle: float = 1.0
    answer: float = 5.0
    wall_time: bool = False
    nav2: bool = False
    parameters: Optional[Dict[str, Dict[str, Any]]] = None
    parameter_file: str = ""


GLOBAL_TOPICS = ("/clock",)
"""Topics outside of the namespace: nodes of all namespaces share one time."""


class TopicNames:
    """Maps topics of the protocol to topics of the graph.

    A remapping is written `/scan:=/front/scan`. A target without a leading slash is relative to the namespace. Topics
    without a remapping, except /clock, are moved to the namespace.
    """

    def __init__(self, namespace: str, remappings: Iterable[str]) -> None:
        self.namespace = "/" + namespace.strip("/") if namespace.strip("/") else ""
        self._targets: Dict[str, str] = {}
        for text in remappings:
            source, separator, target = text.partition(":=")
            if not separator or not source or not target:
                raise AdapterError(f"--remap {text}: not of the form /from:=/to")
            self._targets["/" + source.lstrip("/")] = target

    def __call__(self, topic: str) -> str:
        """Return the name in the graph of `topic`, which begins with a slash."""
        target = self._targets.get(topic)
        if target is None:
            return topic if topic in GLOBAL_TOPICS else self.namespace + topic
        return target if target.startswith("/") else f"{self.namespace}/{target}"
