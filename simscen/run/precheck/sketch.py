"""A picture of what `validate` refuses: the world, the robot at its start and its goals, and the gap that is closed."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.outputs import require_plain
from simscen.run.precheck.scene import Scene
from simscen.worlds.overlap import placed


def draw(scene: Scene, gaps: Sequence[tuple[float, float]], folder: Path) -> Path:
    """Write `<folder>/<id>.png`, and say where. Raises UsageError when it cannot be written."""
    from simscen.worlds.build import build
    from simscen.worlds.picture import picture

    low, high = scene.z_range
    height = (low + high) / 2
    poses = [scene.start, *(goal.pose for _, goal in scene.targets)]
    image = picture(build(scene.world, height), height, [placed(scene.outline, pose) for pose in poses], gaps)
    file = folder / f"{scene.loaded.title}.png"
    try:
        require_plain(file)
        file.parent.mkdir(parents=True, exist_ok=True)
        image.save(file)
    except OSError as error:
        raise UsageError(f"cannot write the picture {file}: {error.strerror}") from error
    return file
