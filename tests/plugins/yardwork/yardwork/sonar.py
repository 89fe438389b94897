"""`sonar`: parameters of a ring of ultrasonic sensors, without the simulation."""

from typing import Annotated, ClassVar

from pydantic import Field

from simscen.plugin import Frequency, Mount, NonNegativeLength, PositiveAngle, PositiveLength, SensorSpec, by_default


class Sonar(SensorSpec):
    """A ring of ultrasonic sensors: each tells the nearest thing in its cone, as one beam of a scan.

    Example: `sonar: {rate: 20 Hz, sensors: 8}`
    """

    component: ClassVar[str] = "yardwork.sonar_ring:SonarRing"
    reading_type: ClassVar[str] = "Scan"

    rate: Frequency = 20.0
    sensors: Annotated[int, Field(ge=1, le=64)] = 8
    """All around, the first straight ahead."""
    cone: PositiveAngle = 0.5
    """Opening angle of each."""
    min_range: NonNegativeLength = 0.02
    max_range: PositiveLength = 4.0
    noise: NonNegativeLength = 0.01
    """Standard deviation of a range."""
    mount: Mount = by_default()
