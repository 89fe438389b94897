"""Options and errors of `simscen ros2`, and what follows from the options: topic names and the ROS domain of a run.

A run has a ROS_DOMAIN_ID that no other run of this user on this machine uses at the same time. To ensure this, a run
locks the file of its domain. The kernel releases the lock when the process ends.
"""

import fcntl
import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Any, Dict, Iterable, List, Mapping, NamedTuple, Optional


class AdapterError(Exception):
    """The run cannot continue; the message says what is wrong and what to do."""


class BringUpAborted(AdapterError):
    """The lifecycle manager of a launched Nav2 has given up. `manager` is its name."""

    def __init__(self, message: str, manager: str) -> None:
        super().__init__(message)
        self.manager = manager


class Options(NamedTuple):
    """Options of `simscen ros2`; see its --help. Times are in s."""

    launch: Optional[str] = None
    domain: Optional[int] = None
    namespace: str = ""
    remap: List[str] = []
    without: List[str] = []
    goals: str = "auto"
    frame: List[str] = []
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
"""Topics that are not moved to the namespace, because nodes of all namespaces use the same clock."""


class TopicNames:
    """Callable that maps topics of the stack protocol to their names in the graph.

    A remapping has the form `/scan:=/front/scan`. A target without a leading slash is relative to the namespace. Topics
    without a remapping, except /clock, are moved to the namespace. Raises AdapterError for a remapping of another form.
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


ROBOT_VARIABLE = "SIMSCEN_ROBOT"
"""Environment variable with the name of the robot; set if the scenario has several robots."""
DOMAINS = range(1, 102)
"""ROS domains for runs. 0 is the default of all ROS users, and above 101, ports may be ephemeral ports of Linux."""


class Domain(NamedTuple):
    """A ROS domain that is reserved for this run until `release` or the end of the process."""

    number: int
    lock: IO[str]

    def release(self) -> None:
        """Allow other runs to use the domain."""
        self.lock.close()


def claim_domain(requested: Optional[int], environment: Mapping[str, str]) -> Domain:
    """Reserve the domain `requested`, or for None the first free one. Raises AdapterError if it is in use."""
    folder = _lock_folder(environment)
    for number in DOMAINS if requested is None else (requested,):
        lock = (folder / f"{number}.lock").open("a+")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        return Domain(number, lock)
    if requested is None:
        raise AdapterError(f"all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use by other runs")
    if environment.get(ROBOT_VARIABLE):
        raise AdapterError(
            f"another robot or run is using ROS domain {requested}: with several robots, each has "
            "a ROS graph of its own; with --launch each has nodes and a domain of its own"
        )
    raise AdapterError(
        f"another run is using ROS domain {requested}: nodes that you start yourself serve one run at a time "
        "(simscen run --jobs 1); with --launch each run has nodes and a domain of its own"
    )


def _lock_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder of the lock files, which is the same in all sessions of a user."""
    runtime = environment.get("XDG_RUNTIME_DIR")
    if not runtime or not os.access(runtime, os.W_OK):
        runtime = str(Path(tempfile.gettempdir(), f"simscen-{os.getuid()}"))
    folder = Path(runtime, "simscen-ros2")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise AdapterError(f"{folder} belongs to another user")
    return folder


def ros_environment(domain: int, log_folder: str, environment: Mapping[str, str]) -> Mapping[str, str]:
    """Return the environment variables of the adapter and its nodes: the ROS domain, restricted to this machine."""
    env = dict(environment, ROS_DOMAIN_ID=str(domain), ROS_LOG_DIR=log_folder)
    # simscen's virtual environment would hide the Python that has rclpy from the user's commands.
    env["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment.get("PATH", os.defpath)])
    env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    # Deprecated since Iron; older distributions know nothing else.
    if environment.get("ROS_DISTRO") in ("foxy", "galactic", "humble"):
        env["ROS_LOCALHOST_ONLY"] = "1"
    else:
        env.pop("ROS_LOCALHOST_ONLY", None)
    return env
