"""Command `simscen ros2`, which starts the adapter between a run and a ROS 2 graph, or checks Nav2 parameters."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import as_text, print_text, relative_to_working_folder
from simscen.core.errors import InvalidInput, UsageError
from simscen.loading.stacks.nav2_parameters import Nav2Parameters, read_nav2_parameters
from simscen.ros2.graph_names import FrameNames, TopicNames
from simscen.ros2.nav2.parameter_rules import PublishedNames
from simscen.ros2.options import AdapterError

SOCKET_VARIABLE = "SIMSCEN_STACK_FD"
"""Environment variable with the file descriptor of the socket to the simulation; set only during a run."""
_ADAPTER_START = Path(__file__).parents[2] / "ros2" / "start.py"
"""Program of the adapter, which runs with the Python interpreter of ROS."""
_BASE_FRAME = "base_link"
"""Default of --base-frame."""


class GraphKind(str, Enum):
    """Kind of the ROS 2 graph: any nodes, or Nav2, for which there are additional checks."""

    ANY = "graph"
    NAV2 = "nav2"


class Sync(str, Enum):
    """Synchronization with the graph: the simulation waits for the nodes, or runs at a fixed speed."""

    LOCKSTEP = "lockstep"
    PACED = "paced"


class Goals(str, Enum):
    """Action or topic to which goals are sent; `auto` selects the one that exists."""

    AUTO = "auto"
    NAVIGATE_TO_POSE = "navigate_to_pose"
    NAVIGATE_THROUGH_POSES = "navigate_through_poses"
    FOLLOW_WAYPOINTS = "follow_waypoints"
    GOAL_POSE = "goal_pose"


def command(
    kind: Annotated[
        GraphKind, typer.Argument(help="`nav2` also checks for the nodes that Nav2 needs.")
    ] = GraphKind.ANY,
    launch: Annotated[
        str | None, typer.Option(help="Command that starts the nodes for each run; they are stopped after it.")
    ] = None,
    params: Annotated[
        Path | None, typer.Option(help="With nav2: check the parameter file with which Nav2 was started.")
    ] = None,
    python: Annotated[
        str | None,
        typer.Option(
            help="Python interpreter with rclpy; default: SIMSCEN_ROS_PYTHON, or the first such python3 on the PATH."
        ),
    ] = None,
    sync: Annotated[
        Sync,
        typer.Option(help="lockstep: the simulation waits for the nodes; paced: it runs at --factor times real time."),
    ] = Sync.LOCKSTEP,
    factor: Annotated[float, typer.Option(min=0.01, max=1000, help="With paced: speed relative to real time.")] = 1.0,
    goals: Annotated[Goals, typer.Option(help="Action of Nav2, or topic /goal_pose; auto: the one that exists.")] = (
        Goals.AUTO
    ),
    namespace: Annotated[str, typer.Option(help="Namespace of all topics of the robot, except /clock.")] = "",
    remap: Annotated[
        list[str] | None, typer.Option(help="/from:=/to: other name of a topic in your graph; repeatable.")
    ] = None,
    without: Annotated[list[str] | None, typer.Option(help="Topic not to publish; repeatable.")] = None,
    frame: Annotated[
        list[str] | None,
        typer.Option(help="FRAME:=NAME: other name of base_link or of a sensor's frame in your graph; repeatable."),
    ] = None,
    base_frame: Annotated[
        str, typer.Option(help="Additional name of the base frame, e.g. base_footprint.")
    ] = _BASE_FRAME,
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="ROS_DOMAIN_ID; default with --launch: an unused one.")
    ] = None,
    warm_up: Annotated[
        float,
        typer.Option(
            min=0, max=600, help="Simulated time in s that passes at real-time speed before the goals are sent."
        ),
    ] = 0.0,
    ready: Annotated[float, typer.Option(min=0.1, max=3600, help="Maximum time to wait for the graph, in s.")] = 20.0,
    settle: Annotated[
        float,
        typer.Option(min=0, max=60, help="Time in s for which the graph must stay unchanged before the run starts."),
    ] = 1.0,
    answer: Annotated[
        float, typer.Option(min=0.1, max=3600, help="Maximum time to wait for a node to respond to a request, in s.")
    ] = 5.0,
    wait: Annotated[
        float, typer.Option(min=0, max=60, help="With lockstep: maximum time to wait for a velocity command, in s.")
    ] = 0.05,
    rounds: Annotated[
        int,
        typer.Option(
            min=0,
            max=100,
            help="With lockstep: if no velocity command has arrived, wait for a response of every node again, at most "
            "this many times; 0: as many times as there are nodes.",
        ),
    ] = 0,
    wall_time: Annotated[bool, typer.Option(help="Accept nodes that do not use sim time.")] = False,
) -> None:
    """Connect a ROS 2 graph, such as Nav2, as the stack of a run.

    Use this command as `simscen run SCENARIO --stack mine='simscen ros2 --launch "ros2 launch …"'`. The adapter runs
    with the Python of your ROS installation, of any distribution and with any RMW, and needs only rclpy there. It
    publishes sensors, /tf, /map, and /clock, receives commands, and sends goals to Nav2's actions or to /goal_pose. If
    something that the run needs is missing in the graph, the run ends with an error that names it.

    Without a run, `simscen ros2 nav2 --params FILE` only checks the parameter file. Exit code 0: Nav2 can work with
    these parameters; 2: Nav2 cannot work with them, or the command line is invalid.
    """
    try:
        base_frames = FrameNames(frame or [], base_frame).base_frames
        topics = TopicNames(namespace, remap or [])
    except AdapterError as error:
        raise UsageError(str(error)) from error
    parameters = None if params is None else read_nav2_parameters(params)
    if isinstance(parameters, list):
        raise InvalidInput(relative_to_working_folder(parameters, Path.cwd()))
    if SOCKET_VARIABLE not in os.environ:
        names = PublishedNames([topics("/scan")], topics("/odom"), base_frames, topics.namespace)
        _check_parameters(kind, parameters, names)
        return
    options = {
        "launch": launch,
        "domain": domain,
        "namespace": namespace,
        "remap": remap or [],
        "without": without or [],
        "frame": frame or [],
        "base_frame": base_frame,
        "goals": goals.value,
        "sync": sync.value,
        "factor": factor,
        "rounds": rounds,
        "wait": wait,
        "warm_up": warm_up,
        "ready": ready,
        "settle": settle,
        "answer": answer,
        "wall_time": wall_time,
        "nav2": kind is GraphKind.NAV2,
        "parameters": parameters.nodes if parameters is not None else None,
        "parameter_file": str(params) if params is not None else "",
    }
    interpreter = python or _find_python()
    try:
        # The adapter replaces this process, and inherits the socket to the simulation.
        os.execvp(interpreter, [interpreter, str(_ADAPTER_START), json.dumps(options)])
    except OSError as error:
        raise UsageError(f"cannot run {interpreter}: {error.strerror}") from error


def _check_parameters(kind: GraphKind, parameters: Nav2Parameters | None, names: PublishedNames) -> None:
    """Check Nav2 parameters. Raises UsageError without parameters, and InvalidInput if Nav2 cannot work with them."""
    if kind is not GraphKind.NAV2 or parameters is None:
        command = shlex.join(["simscen", *sys.argv[1:]])
        raise UsageError(f"no run to connect to; use simscen run SCENARIO --stack mine={shlex.quote(command)}")
    problems = parameters.problems(names)
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(problems)
    if problems:
        print_text(as_text(problems), sys.stderr)
    available = f"{', '.join(names.scans)}, {names.odometry}, and {' or '.join(names.base_frames)}"
    print_text(f"{parameters.display_name}: Nav2 can work with simscen's {available}")


def _find_python() -> str:
    """Return the interpreter in SIMSCEN_ROS_PYTHON, or the first one on the PATH with rclpy. Raises UsageError."""
    configured = os.environ.get("SIMSCEN_ROS_PYTHON")
    if configured:
        return configured
    folders = [folder for folder in os.get_exec_path() if folder]
    candidates = [found for folder in folders if (found := shutil.which("python3", path=folder))]
    for candidate in dict.fromkeys([*candidates, "/usr/bin/python3"]):
        if _has_rclpy(candidate):
            return candidate
    hint = "source the setup.bash of your ROS first, or use simscen ros2 --python /usr/bin/python3"
    raise UsageError(f"no Python on the PATH has rclpy; {hint}")


def _has_rclpy(python: str) -> bool:
    try:
        result = subprocess.run([python, "-c", "import rclpy"], capture_output=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return result.returncode == 0
