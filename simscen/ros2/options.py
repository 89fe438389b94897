"""What the user asked for on the command line of `simscen ros2`."""

from typing import Any, Dict, List, NamedTuple, Optional


class Options(NamedTuple):
    """As `simscen ros2 --help` explains them; times in seconds."""

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
