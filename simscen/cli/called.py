"""The environment that simscen was called with, and where the user's own configuration lies in it."""

import os
from pathlib import Path

PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
COMPLETE = "_SIMSCEN_COMPLETE"
"""By this variable a shell says that it wants to know what may be typed next; the name is click's."""
_AT_START = os.environ.get(PLUGINS)
"""As the caller had it: `simscen` sets it for itself before anything else."""


def environment() -> dict[str, str]:
    """The variables that the user has: what is started for them shall meet them as in their shell."""
    variables = {name: value for name, value in os.environ.items() if name != PLUGINS}
    return variables if _AT_START is None else {**variables, PLUGINS: _AT_START}


def config_file() -> Path:
    """$XDG_CONFIG_HOME/simscen/config.yaml; ~/.config where that is not an absolute folder (XDG Base Directory)."""
    home = Path(os.environ.get("XDG_CONFIG_HOME", ""))
    return (home if home.is_absolute() else Path("~/.config").expanduser()) / "simscen" / "config.yaml"
