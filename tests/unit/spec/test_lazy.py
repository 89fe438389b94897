import subprocess
import sys
from typing import Annotated

import pytest
from pydantic import ValidationError

from simscen.actions.registry import AnyAction
from simscen.criteria.registry import AnyCriterion
from simscen.faults.registry import AnyFault
from simscen.model.world import Wall
from simscen.spec.base import Spec
from simscen.spec.lazy_spec import LazySpec, annotation_of
from simscen.triggers.registry import AnyCondition as AnyTest


class Site(Spec):
    wall: Annotated[Spec | None, LazySpec("simscen.model.world", "Wall")] = None
    number: int = 0


def test_a_mapping_becomes_the_specification_and_a_specification_stays_itself():
    site = Site.model_validate({"wall": {"points": [[0, 0], ["1 m", 0]]}})
    assert isinstance(site.wall, Wall)
    assert site.wall.points == [[0.0, 0.0], [1.0, 0.0]]
    assert Site(wall=site.wall).wall is site.wall
    assert Site.model_validate({}).wall is None


def test_problems_are_told_at_their_places_together_with_those_around():
    with pytest.raises(ValidationError) as raised:
        Site.model_validate({"wall": {"points": [[0, 0], [1, "x"]], "color": 1}, "number": "one"})
    assert {error["loc"] for error in raised.value.errors()} == {
        ("wall", "points", 1, "written out", 1),
        ("wall", "color"),
        ("number",),
    }


def test_the_json_schema_is_that_of_a_field_imported_at_once():
    class Eager(Spec):
        wall: Wall | None = None
        number: int = 0

    eager, lazy = Eager.model_json_schema(), Site.model_json_schema()
    lazy["properties"]["wall"].pop("title")  # pydantic's default for what is no model
    assert lazy["properties"] == eager["properties"]
    assert lazy["$defs"] == eager["$defs"]


@pytest.mark.parametrize("choice", [AnyCriterion, AnyAction, AnyFault, AnyTest])
def test_every_choice_on_demand_is_there_and_is_what_its_list_promises(choice):
    fields = [field for field in choice.model_fields.values() if any(isinstance(m, LazySpec) for m in field.metadata)]
    assert len(fields) >= 6
    for field in fields:
        assert issubclass(annotation_of(field), field.annotation.__args__[0])


def test_what_no_file_uses_is_not_imported():
    code = (
        "import sys, simscen.model.scenario; print(*sorted(m for m in sys.modules if m.startswith('simscen.criteria')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [
        "simscen.criteria",
        "simscen.criteria.base",
        "simscen.criteria.registry",
    ]


class Sites(Spec):
    walls: list[Annotated[Spec, LazySpec("simscen.model.world", "Wall")]]


def test_an_item_of_a_list_is_the_specification_and_never_nothing():
    assert isinstance(Sites.model_validate({"walls": [{"points": [[0, 0], [1, 0]]}]}).walls[0], Wall)
    with pytest.raises(ValidationError) as raised:
        Sites.model_validate({"walls": [None]})
    assert raised.value.errors()[0]["loc"] == ("walls", 0)
    assert Sites.model_json_schema()["properties"]["walls"]["items"] == {"$ref": "#/$defs/Wall"}
