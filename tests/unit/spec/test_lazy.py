"""Tests of fields whose specifications are imported on first use."""

import subprocess
import sys
from typing import Annotated

import pytest
from pydantic import ValidationError

from simscen.actions.base import AnyAction
from simscen.criteria.registry import AnyCriterion
from simscen.faults.base import AnyFault
from simscen.model.world import Wall
from simscen.spec.base import LazySpec, Spec, annotation_of
from simscen.triggers.base import AnyCondition


class Site(Spec):
    wall: Annotated[Spec | None, LazySpec("simscen.model.world", "Wall")] = None
    number: int = 0


def test_mapping_is_validated_and_specification_is_returned_unchanged():
    site = Site.model_validate({"wall": {"points": [[0, 0], ["1 m", 0]]}})
    assert isinstance(site.wall, Wall)
    assert site.wall.points == [[0.0, 0.0], [1.0, 0.0]]
    assert Site(wall=site.wall).wall is site.wall
    assert Site.model_validate({}).wall is None


def test_errors_in_lazy_fields_have_their_locations():
    with pytest.raises(ValidationError) as raised:
        Site.model_validate({"wall": {"points": [[0, 0], [1, "x"]], "color": 1}, "number": "one"})
    assert {error["loc"] for error in raised.value.errors()} == {
        ("wall", "points", 1, "a mapping", 1),
        ("wall", "color"),
        ("number",),
    }


def test_json_schema_equals_that_of_an_eager_field():
    class Eager(Spec):
        wall: Wall | None = None
        number: int = 0

    eager, lazy = Eager.model_json_schema(), Site.model_json_schema()
    lazy["properties"]["wall"].pop("title")  # pydantic's default for what is no model
    assert lazy["properties"] == eager["properties"]
    assert lazy["$defs"] == eager["$defs"]


@pytest.mark.parametrize("choice", [AnyCriterion, AnyAction, AnyFault, AnyCondition])
def test_every_lazy_choice_exists_with_the_promised_type(choice):
    fields = [field for field in choice.model_fields.values() if any(isinstance(m, LazySpec) for m in field.metadata)]
    assert len(fields) >= 6
    for field in fields:
        assert issubclass(annotation_of(field), field.annotation.__args__[0])


def test_unused_choices_are_not_imported():
    code = (
        "import sys, simscen.model.scenario; print(*sorted(m for m in sys.modules if m.startswith('simscen.criteria')))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.split() == [
        "simscen.criteria",
        "simscen.criteria.base",
        "simscen.criteria.registry",
    ]


class Sites(Spec):
    walls: list[Annotated[Spec, LazySpec("simscen.model.world", "Wall")]]


def test_list_items_are_validated_and_not_optional():
    assert isinstance(Sites.model_validate({"walls": [{"points": [[0, 0], [1, 0]]}]}).walls[0], Wall)
    with pytest.raises(ValidationError) as raised:
        Sites.model_validate({"walls": [None]})
    assert raised.value.errors()[0]["loc"] == ("walls", 0)
    assert Sites.model_json_schema()["properties"]["walls"]["items"] == {"$ref": "#/$defs/Wall"}


def test_only_the_specification_of_the_named_controller_is_imported():
    code = (
        "import sys; from simscen.model.stack import StackSpec;"
        "StackSpec.model_validate({}); print('simscen.model.mppi' in sys.modules);"
        "StackSpec.model_validate({'controller': {'type': 'mppi'}}); print('simscen.model.mppi' in sys.modules)"
    )
    output = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert output.split() == ["False", "True"]
