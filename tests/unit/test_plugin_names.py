"""Tests of the names in simscen.plugin."""

import inspect
import subprocess
import sys
from typing import Annotated, get_origin

import pytest

import simscen.plugin as public


@pytest.mark.parametrize("name", public.__all__)
def test_public_name_equals_the_name_of_its_object(name: str) -> None:
    value = getattr(public, name)
    if getattr(value, "__module__", "").startswith("simscen.") and hasattr(value, "__name__"):
        if get_origin(value) is Annotated:
            return
        assert value.__name__ == name
        assert inspect.getdoc(value)


def test_type_checkers_see_the_existing_names() -> None:
    source = inspect.getsource(public)
    imports = source[source.index("if TYPE_CHECKING") : source.index("__all__")]
    for module, names in public._NAMES_BY_MODULE.items():
        assert f"from {module} import " in imports
        for name in names:
            assert f" {name}" in imports
    assert sorted(public._MODULE_OF) == sorted(public.__all__)


def test_missing_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Nonsense'"):
        public.Nonsense  # noqa: B018


def test_a_specification_imports_no_engine() -> None:
    imports = "import sys; from simscen.plugin import PlannerSpec, PositiveLength, InProcessStack;"
    heavy = "print(sorted({'scipy', 'ompl', 'pybullet', 'trimesh', 'filterpy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", imports + heavy], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
