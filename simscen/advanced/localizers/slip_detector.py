"""Whether wheels hold: what they say of each turn against a gyroscope, step by step and over the last half second."""

from collections import deque

# Of the squared innovation over its variance: wheels that fit no worse by chance once in 10 000 steps.
_GATE = 15.1
# Seconds whose innovations are added up, and their gate, once in a million: slips too small for a step to tell.
_WINDOW, _WINDOW_GATE = 0.5, 24.0
# Such wheels hold again when they fit this long as well as 19 in 20 that do.
_RELEASE, _RELEASE_GATE = 0.15, 4.0


class SlipDetector:
    """A gate for the wheels' turn rate as a gyroscope's innovations pass it."""

    def __init__(self) -> None:
        self._lately: deque[tuple[float, float, float]] = deque()  # rad, rad², seconds of each step
        self._loose = self._slips = False

    def slipped(self, innovation: float, noise: float, bias: float, seconds: float) -> float:
        """For how many seconds the wheels have slipped by the end of this step and nobody knew; 0 where they hold.

        `innovation` in rad/s and the variances of `noise`, of this step alone, and of the gyroscope's `bias`.
        """
        lasted, known = self._together(innovation * seconds, noise * seconds**2, bias, seconds), self._slips
        self._loose = lasted > 0.0
        self._slips = self._loose or innovation**2 > _GATE * (noise + bias)
        if not self._slips:
            return 0.0
        return seconds if known else max(seconds, lasted)

    def _together(self, innovation: float, noise: float, bias: float, seconds: float) -> float:
        """The seconds over which the last innovations, in rad, add up to more than chance; else 0."""
        self._lately.append((innovation, noise, seconds))
        window, gate = (_RELEASE, _RELEASE_GATE) if self._loose else (_WINDOW, _WINDOW_GATE)
        while len(self._lately) > 1 and sum(step[2] for step in self._lately) > window + 1e-9:
            self._lately.popleft()
        total, variance, lasted = map(sum, zip(*self._lately, strict=True))
        return lasted if total**2 > gate * (variance + bias * lasted**2) else 0.0
