"""Which logs the arguments of a command mean: a file, the folder of a run, a rosbag2, or a folder full of them."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, NothingSelected
from simscen.core.problems import Problem
from simscen.loading.messages import quoted
from simscen.loading.paths import is_folder
from simscen.loading.source import reason

WHOLE, BROKEN_OFF = "run.mcap", "run.partial.mcap"
BAG = "metadata.yaml"
SUFFIXES = (".mcap", ".db3", ".bag")


def logs_of(paths: Sequence[Path]) -> list[Path]:
    """All of them, each once, sorted within a folder. Raises InvalidInput, and NothingSelected where there are none."""
    found: dict[Path, None] = {}
    for path in paths:
        try:
            path.lstat()
        except (OSError, ValueError) as error:
            told = reason(error) if isinstance(error, OSError) else "no such file or directory"
            raise InvalidInput([Problem(str(path), 0, 0, "SC800", told)]) from error
        inside = sorted(_logs(path), key=lambda log: log.parts) if is_folder(path) else [path]
        found.update(dict.fromkeys(inside))
    if not found:
        where = ", ".join(quoted(str(path)) for path in paths)
        raise NothingSelected(f"no logs found in {where}; a folder is searched for *.mcap and rosbag2 folders")
    return list(found)


def _logs(path: Path) -> Iterator[Path]:
    for folder, below, names in os.walk(path):
        here = Path(folder)
        if is_bag(names):
            below.clear()
            yield here
            continue
        below[:] = sorted(name for name in below if not name.startswith("."))
        logs = sorted(name for name in names if name.endswith(SUFFIXES))
        yield from (here / name for name in logs if not (name == BROKEN_OFF and WHOLE in logs))


def is_bag(names: Sequence[str]) -> bool:
    """Whether the files of a folder are those of a rosbag2."""
    return BAG in names and any(name.endswith((".db3", ".mcap", ".db3.zstd", ".mcap.zstd")) for name in names)
