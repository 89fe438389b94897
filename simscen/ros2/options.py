"""Options and errors of `simscen ros2`, names of topics, and the ROS domain of a run.

Each run locks a file for its ROS_DOMAIN_ID, so that no other run of this user on this machine uses the same domain.
"""

import fcntl
import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Any, Dict, Iterable, List, Mapping, NamedTuple, Optional


class AdapterError(Exception):
    """Failure of the adapter, which ends the run. The message states the problem and its solution."""


class BringUpAborted(AdapterError):
    """Failure of a launched Nav2 to start: its lifecycle manager, with the name `manager`, has given up."""

    def __init__(self, message: str, manager: str) -> None:
        super().__init__(message)
        self.manager = manager


class Options(NamedTuple):
    """Options of `simscen ros2`. Times are in s.

    launch:      command that starts the nodes; None if the user starts them
    domain:      ROS_DOMAIN_ID; None to select it automatically
    namespace:   namespace of the topics, such as "robot1"
    remap:       renamed topics, `/from:=/to`
    without:     topics that simscen does not publish
    goals:       how goals are sent: a Nav2 action, "goal_pose", or "auto"
    frame:       renamed frames, `FRAME:=NAME`
    base_frame:  second name of the base frame
    sync:        "lockstep" or "paced"
    factor:      speed relative to real time if `sync` is "paced"
    rounds:      extra waits for all nodes (see node_barrier.py) if no command has arrived; 0 = as many as there are
        nodes
    wait:        maximum wall time to wait for a command
    warm_up:     simulated time before goals are sent
    ready:       maximum wall time until the nodes are ready
    settle:      wall time for which the nodes of the graph must be unchanged before the run
    answer:      maximum wall time to wait for an answer of a node
    wall_time:   whether to accept nodes without use_sim_time
    nav2:        whether to require Nav2's nodes and check their parameters
    parameters:  content of `parameter_file`, by node
    """

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
"""Topics that are not moved to the namespace."""


class TopicNames:
    """Callable that maps topics of the stack protocol to their names in the graph.

    Remappings have the form `/scan:=/front/scan`. A new name without a leading slash is relative to the namespace.
    Topics without a remapping are moved to the namespace, except /clock. Raises AdapterError for an invalid remapping.
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
"""ROS domains for runs. 0 is the default domain. Ports of domains above 101 may be ephemeral ports of Linux."""


class Domain(NamedTuple):
    """A ROS domain that is reserved for this process until `release`."""

    number: int
    lock: IO[str]

    def release(self) -> None:
        """Allow other runs to use the domain."""
        self.lock.close()


def claim_domain(requested: Optional[int], environment: Mapping[str, str]) -> Domain:
    """Reserve the domain `requested`; None reserves the first free domain. Raises AdapterError if it is in use."""
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
    """Return the folder of the user's lock files."""
    runtime = environment.get("XDG_RUNTIME_DIR")
    if not runtime or not os.access(runtime, os.W_OK):
        runtime = str(Path(tempfile.gettempdir(), f"simscen-{os.getuid()}"))
    folder = Path(runtime, "simscen-ros2")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise AdapterError(f"{folder} belongs to another user")
    return folder


def ros_environment(domain: int, log_folder: str, environment: Mapping[str, str]) -> Mapping[str, str]:
    """Return environment variables that restrict the adapter and its nodes to a ROS domain on this machine."""
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
