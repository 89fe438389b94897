"""The message, action and service types of the user's distribution, found by name."""

import importlib
from typing import Any, Optional


def find(name: str) -> Optional[Any]:
    """The class of `nav_msgs/msg/Odometry`; None where the distribution does not have it."""
    package, kind, name = name.split("/")
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ModuleNotFoundError as error:
        if error.name is not None and error.name.split(".")[0] != package:
            raise
        return None
    return getattr(module, name, None)
