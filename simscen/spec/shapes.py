"""Specification of objects with a simple shape."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Shape, Solid
from simscen.spec.base import Spec
from simscen.spec.places import Ring
from simscen.spec.quantities import NonNegativeLength, PositiveLength


class ShapedObject(Spec):
    """Object with exactly one shape: a box, a cylinder, or a prism over a polygon."""

    box: Annotated[list[PositiveLength], Field(min_length=3, max_length=3)] | None = None
    """Box: length along x, width along y, height."""
    cylinder: Annotated[list[PositiveLength], Field(min_length=2, max_length=2)] | None = None
    """Upright cylinder: radius, height."""
    polygon: Ring | None = None
    """Upright prism over a polygon with these corners."""
    height: PositiveLength = 1.0
    """Height of the prism over `polygon`; not valid with `box` and `cylinder`."""
    z: NonNegativeLength = 0.0
    """Height of the underside above the ground."""

    @model_validator(mode="after")
    def _check_shape(self) -> ShapedObject:
        if sum(shape is not None for shape in (self.box, self.cylinder, self.polygon)) != 1:
            raise ValueError("expected exactly one of: box, cylinder, polygon")
        if self.polygon is None and self.height != type(self).model_fields["height"].default:
            raise ValueError("`height` is only for `polygon`; the last number of `box` and `cylinder` is the height")
        return self

    @property
    def total_height(self) -> float:
        """Height in m from the underside of the object to its top."""
        return self.box[2] if self.box is not None else self.cylinder[1] if self.cylinder is not None else self.height

    def solid(self, name: str) -> Solid:
        """Return the object as a named solid. The origin of its frame is on the ground below the object."""
        shape: Shape
        if self.box is not None:
            shape, middle = Box((self.box[0], self.box[1], self.box[2])), self.box[2] / 2
        elif self.cylinder is not None:
            shape, middle = Cylinder(self.cylinder[0], self.cylinder[1]), self.cylinder[1] / 2
        else:
            assert self.polygon is not None
            shape, middle = Extrusion(tuple((x, y) for x, y in self.polygon), self.height), 0.0
        return Solid(shape, Pose3(z=self.z + middle), name)
