"""Fixtures that expand xacro files in a temporary folder."""

import pytest

from simscen.assets.folders import AllowedFolders
from simscen.core.errors import InvalidInput
from simscen.sim.urdf.xacro.expand import expand as expand_xacro
from simscen.sim.urdf.xml_source import read_xml


@pytest.fixture
def expand(tmp_path):
    def expand(text, **files):
        """Expand the content of a <robot>; `files` are written beside it, `pkg__name` into a folder pkg.

        `name__yaml` becomes the YAML file name.yaml.
        """
        for name in [name for name in files if name.endswith("__yaml")]:
            (tmp_path / name.replace("__", ".")).write_text(files.pop(name))
        for name, content in {"main": text, **files}.items():
            path = tmp_path / f"{name.replace('__', '/')}.xacro"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f'<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">{content}</robot>')
        folders = AllowedFolders.of([tmp_path])
        path = tmp_path / "main.xacro"
        return expand_xacro(read_xml(path, folders), path, folders, lambda included: read_xml(included, folders))

    return expand


@pytest.fixture
def value(expand):
    """Return a function that returns the text to which an expression is expanded."""

    def value(expression, before=""):
        return expand(f'{before}<a v="{expression}"/>').children[-1].attributes["v"]

    return value


@pytest.fixture
def refusal(expand):
    """Return a function that returns the first problem of an invalid file."""

    def refusal(text, **files):
        with pytest.raises(InvalidInput) as caught:
            expand(text, **files)
        return caught.value.problems[0]

    return refusal
