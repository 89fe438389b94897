"""`simscen ros2`."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from simscen.cli.diagnostics import as_text, from_here, print_text
from simscen.core.errors import InvalidInput, UsageError
from simscen.loading.nav2.parameterfile import Nav2Parameters, read_nav2_parameters
from simscen.ros2.nav2_parameters import Offer

SOCKET = "SIMSCEN_STACK_FD"
_START = Path(__file__).parents[2] / "ros2" / "start.py"
_BASE = "base_link"


class What(str, Enum):
    """What is behind the graph."""

    GRAPH = "graph"
    NAV2 = "nav2"


class Sync(str, Enum):
    """Who waits for whom."""

    LOCKSTEP = "lockstep"
    PACED = "paced"


class Goals(str, Enum):
    """How goals are given."""

    AUTO = "auto"
    NAVIGATE_TO_POSE = "navigate_to_pose"
    NAVIGATE_THROUGH_POSES = "navigate_through_poses"
    FOLLOW_WAYPOINTS = "follow_waypoints"
    GOAL_POSE = "goal_pose"


def command(
    what: Annotated[What, typer.Argument(help="`nav2` looks for what Nav2 needs, too.")] = What.GRAPH,
    launch: Annotated[
        str | None, typer.Option(help="Start the nodes with this command, for each run anew, and end them with it.")
    ] = None,
    params: Annotated[
        Path | None, typer.Option(help="With nav2: the parameter file that Nav2 was started with, to be checked.")
    ] = None,
    python: Annotated[
        str | None, typer.Option(help="The Python that has rclpy; default: the first on the PATH that has.")
    ] = None,
    sync: Annotated[Sync, typer.Option(help="Simulation waits for the graph, or runs at a pace of its own.")] = (
        Sync.LOCKSTEP
    ),
    factor: Annotated[float, typer.Option(min=0.01, max=1000, help="With paced: times real time.")] = 1.0,
    goals: Annotated[Goals, typer.Option(help="An action of Nav2, or a pose on /goal_pose; auto: what is there.")] = (
        Goals.AUTO
    ),
    namespace: Annotated[str, typer.Option(help="The namespace of the robot's topics, all but /clock.")] = "",
    remap: Annotated[
        list[str] | None, typer.Option(help="/from:=/to: a topic that is called otherwise in your graph.")
    ] = None,
    without: Annotated[list[str] | None, typer.Option(help="A topic that simscen shall not publish.")] = None,
    base_frame: Annotated[str, typer.Option(help="What the robot's base is called, too, e.g. base_footprint.")] = _BASE,
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="ROS_DOMAIN_ID; default with --launch: one that is free.")
    ] = None,
    warm_up: Annotated[
        float,
        typer.Option(min=0, max=600, help="Simulated seconds at the pace of real time before the goals are sent."),
    ] = 0.0,
    ready: Annotated[float, typer.Option(min=0.1, max=3600, help="Seconds to wait for the graph.")] = 20.0,
    settle: Annotated[
        float, typer.Option(min=0, max=60, help="Seconds in which no node may come or go before the run begins.")
    ] = 1.0,
    answer: Annotated[float, typer.Option(min=0.1, max=3600, help="Seconds a node may take to answer.")] = 5.0,
    wait: Annotated[
        float, typer.Option(min=0, max=60, help="With lockstep: seconds to wait for a command that has not come.")
    ] = 0.05,
    rounds: Annotated[
        int,
        typer.Option(min=0, max=100, help="With lockstep: rounds to wait for a command; 0: one for each node."),
    ] = 0,
    wall_time: Annotated[bool, typer.Option(help="Accept nodes that do not use sim time.")] = False,
) -> None:
    """Connect a ROS 2 graph, such as Nav2, as the stack of a run.

    Say `simscen run SCENARIO --stack mine='simscen ros2 --launch "ros2 launch …"'`. It runs under your own ROS Python,
    whichever distribution and RMW that is, and needs nothing there but rclpy. Sensors, /tf, /map and /clock go out,
    commands come in, goals go to Nav2's actions or to /goal_pose. When the graph is not what a run needs, the run ends
    in an error that says what is missing.

    With `nav2` and --params, called by hand, it checks the parameter file alone. Exit code 0: nothing keeps Nav2 from
    working; 2: something does, or the command line cannot be used.
    """
    bases = [_BASE] if base_frame == _BASE else [_BASE, base_frame]
    parameters = _read(params) if params is not None else None
    if SOCKET not in os.environ:
        _by_hand(what, parameters, bases)
        return
    options = {
        **{"launch": launch, "domain": domain, "namespace": namespace, "remap": remap or [], "without": without or []},
        **{"goals": goals.value, "base_frame": base_frame, "sync": sync.value, "factor": factor, "rounds": rounds},
        **{
            "wait": wait,
            "warm_up": warm_up,
            "ready": ready,
            "settle": settle,
            "answer": answer,
            "wall_time": wall_time,
        },
        "nav2": what is What.NAV2,
        "parameters": parameters.nodes if parameters is not None else None,
        "parameter_file": str(params) if params is not None else "",
    }
    _become(python or _find_python(), options)


def _read(params: Path) -> Nav2Parameters:
    parameters = read_nav2_parameters(params)
    if isinstance(parameters, list):
        raise InvalidInput(from_here(parameters, Path.cwd()))
    return parameters


def _by_hand(what: What, parameters: Nav2Parameters | None, bases: list[str]) -> None:
    """Without a run to serve, only a parameter file can be checked."""
    if what is not What.NAV2 or parameters is None:
        words = shlex.join(["simscen", *sys.argv[1:]])
        raise UsageError(
            f"there is no run to serve: this is for simscen run SCENARIO --stack mine={shlex.quote(words)}"
        )
    problems = parameters.problems(Offer(["/scan"], "/odom", bases))
    if any(problem.severity == "error" for problem in problems):
        raise InvalidInput(problems)
    if problems:
        print_text(as_text(problems), sys.stderr)
    print_text(
        f"{parameters.shown}: nothing keeps Nav2 from working with simscen's /scan, /odom and {' or '.join(bases)}"
    )


def _find_python() -> str:
    """The first Python 3 on the PATH that has rclpy; a virtual environment around simscen has none as a rule."""
    named = os.environ.get("SIMSCEN_ROS_PYTHON")
    if named:
        return named
    folders = [folder for folder in os.get_exec_path() if folder]
    candidates = [found for folder in folders if (found := shutil.which("python3", path=folder))]
    for candidate in dict.fromkeys([*candidates, "/usr/bin/python3"]):
        if _has_rclpy(candidate):
            return candidate
    hint = "source the setup.bash of your ROS before, or name one: simscen ros2 --python /usr/bin/python3"
    raise UsageError(f"no Python on the PATH has rclpy: {hint}")


def _has_rclpy(python: str) -> bool:
    try:
        tried = subprocess.run([python, "-c", "import rclpy"], capture_output=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return tried.returncode == 0


def _become(python: str, options: Mapping[str, object]) -> NoReturn:
    """Go on as the adapter: the socket to the engine is inherited, and this process is what the engine watches."""
    try:
        os.execvp(python, [python, str(_START), json.dumps(options)])
    except OSError as error:
        raise UsageError(f"cannot run {python}: {error.strerror}") from error
