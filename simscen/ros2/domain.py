"""A ROS_DOMAIN_ID that no other adapter of this user on this machine uses at the same time.

Each domain has a file that its holder has locked; the kernel lets go of it when the process ends, however it ends.
"""

import fcntl
import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Mapping, Optional

from simscen.ros2.failure import Failure

ROBOT = "SIMSCEN_ROBOT"
"""The environment variable with the robot's name, where a scenario has several."""
DOMAINS = range(1, 102)
"""Above 101 the ports of a domain may be those that Linux gives to clients; 0 is everybody's."""


class Domain:
    """A claimed domain: held until `release`, or until the process ends."""

    def __init__(self, number: int, lock: IO[str]) -> None:
        self.number = number
        self._lock = lock

    def release(self) -> None:
        """Let others have it."""
        self._lock.close()


def claim(wanted: Optional[int], environment: Mapping[str, str]) -> Domain:
    """The domain `wanted`, or the first that is free. Raises Failure when there is none."""
    folder = _folder(environment)
    for number in DOMAINS if wanted is None else (wanted,):
        lock = (folder / f"{number}.lock").open("a+")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        return Domain(number, lock)
    if wanted is None:
        raise Failure(f"all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use by other runs")
    if environment.get(ROBOT):
        raise Failure(
            f"another robot or run is using ROS domain {wanted}: with several robots, each has a ROS graph of its own; "
            "with --launch each has nodes and a domain of its own"
        )
    raise Failure(
        f"another run is using ROS domain {wanted}: nodes that you start yourself serve one run at a time "
        "(simscen run --jobs 1); with --launch each run has nodes and a domain of its own"
    )


def _folder(environment: Mapping[str, str]) -> Path:
    """Where the locks lie: this user's own, the same for all sessions."""
    runtime = environment.get("XDG_RUNTIME_DIR")
    if not runtime or not os.access(runtime, os.W_OK):
        runtime = str(Path(tempfile.gettempdir(), f"simscen-{os.getuid()}"))
    folder = Path(runtime, "simscen-ros2")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise Failure(f"{folder} belongs to another user")
    return folder


def surroundings(domain: int, log_folder: str, environment: Mapping[str, str]) -> Mapping[str, str]:
    """What the adapter and the nodes it starts have in their environment: one domain, this machine only."""
    here = dict(environment, ROS_DOMAIN_ID=str(domain), ROS_LOG_DIR=log_folder)
    # A virtual environment around simscen would hide the Python that has rclpy from the commands of the user.
    here["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment.get("PATH", os.defpath)])
    here["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    # Iron and newer call it deprecated, and the ones before it know nothing else.
    if environment.get("ROS_DISTRO") in ("foxy", "galactic", "humble"):
        here["ROS_LOCALHOST_ONLY"] = "1"
    else:
        here.pop("ROS_LOCALHOST_ONLY", None)
    return here
