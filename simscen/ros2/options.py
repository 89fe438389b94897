"""Options and errors of `simscen ros2`."""

from typing import Any, Dict, List, NamedTuple, Optional


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
