"""ROS domain of a run.

Each run locks a file for its ROS_DOMAIN_ID, so that no other run of this user on this machine uses the same domain.
"""

import fcntl
import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Mapping, NamedTuple, Optional

from simscen.ros2.options import AdapterError

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


def user_domain(environment: Mapping[str, str]) -> int:
    """Return the domain of the user's nodes: ROS_DOMAIN_ID, or 0. Raises AdapterError if it is not a number."""
    text = environment.get("ROS_DOMAIN_ID") or "0"
    if not (text.isascii() and text.isdecimal()):
        raise AdapterError(f"ROS_DOMAIN_ID is {text!r}, not a number")
    return int(text)


def claim_domain(requested: Optional[int], environment: Mapping[str, str]) -> Domain:
    """Reserve the domain `requested`, or the first free domain if it is None.

    Raises AdapterError if the domain is in use, or if no domain is free.
    """
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
            f"another robot or run is using ROS domain {requested}: with several robots, each robot needs "
            "its own ROS graph; with --launch each robot gets its own nodes and its own domain"
        )
    raise AdapterError(
        f"another run is using ROS domain {requested}: nodes that you start yourself serve one run at a time "
        "(simscen run --jobs 1); with --launch each run gets its own nodes and its own domain"
    )


def _lock_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder of this user's lock files, and create it. Raises AdapterError if it is another user's."""
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
