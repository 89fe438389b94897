"""Fixtures that load SDF texts."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem
from simscen.worlds.sdf import load_sdf

BOX = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"
LINK = f"<link name='a'>{BOX}</link>"

Load = Callable[..., World]
Refuse = Callable[..., list[Problem]]


@pytest.fixture
def data() -> Path:
    """Return the folder of the third-party worlds."""
    folder = Path(__file__).parents[5] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the third-party worlds are missing: see CONTRIBUTING.md")
    return folder


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Return a function that loads a whole SDF text, or the content of a `<world>` named w."""

    def _load(content: str, version: str = "1.9", lenient: bool = False, **options: object) -> World:
        file = tmp_path / "shop.world"
        whole = content.lstrip().startswith(("<?xml", "<sdf", "<!DOCTYPE"))
        file.write_text(content if whole else f"<sdf version='{version}'><world name='w'>\n{content}</world></sdf>")
        return load_sdf(file, root=tmp_path, lenient=lenient, **options)  # type: ignore[arg-type]

    return _load


@pytest.fixture
def refuse(load: Load) -> Refuse:
    """Return a function that loads an invalid SDF text and returns its problems."""

    def _refuse(content: str, **options: object) -> list[Problem]:
        with pytest.raises(InvalidInput) as caught:
            load(content, **options)
        return caught.value.problems

    return _refuse
