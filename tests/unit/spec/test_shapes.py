"""Tests of the keys of shaped objects."""

import pytest
from pydantic import ValidationError

from simscen.spec.shapes import ShapedObject

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def test_height_belongs_to_a_polygon() -> None:
    assert ShapedObject.model_validate({"polygon": SQUARE, "height": 0.4}).total_height == 0.4
    assert ShapedObject.model_validate({"polygon": SQUARE}).total_height == 1.0


@pytest.mark.parametrize("shape", [{"box": [1, 1, 2]}, {"cylinder": [0.5, 2]}])
def test_height_beside_another_shape_is_refused(shape: dict[str, list[float]]) -> None:
    assert ShapedObject.model_validate(shape).total_height == 2
    with pytest.raises(ValidationError, match="`height` is only for `polygon`"):
        ShapedObject.model_validate({**shape, "height": 2})
