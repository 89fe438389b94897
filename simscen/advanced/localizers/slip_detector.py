"""Detection of wheel slip: the turn rate of the wheels is compared with that of the gyroscope."""

from collections import deque

GATE = 15.1
"""Squared innovation over its variance above which the wheels slip: by chance in one of 10 000 steps (chi-square)."""
WINDOW_S, WINDOW_GATE = 0.5, 24.0
"""Time over which innovations are summed to detect small slip, and the gate of the sum: by chance once in a million."""
RELEASE_S, RELEASE_GATE = 0.15, 4.0
"""Time over which innovations are summed to detect the end of small slip, and the gate of the sum: 95 %."""


class SlipDetector:
    """Detects wheel slip by the innovations of the turn rate."""

    def __init__(self) -> None:
        self._recent: deque[tuple[float, float, float]] = deque()  # rad, rad², seconds of each step
        self._slips_slowly = self._slips = False

    def update(self, innovation: float, noise: float, bias: float, seconds: float) -> float:
        """Return the time in s of slip that was not detected before the end of this step; 0 if the wheels hold.

        innovation:  turn rate of the gyroscope minus that of the wheels, in rad/s
        noise:       variance of this step's innovation, in (rad/s)²
        bias:        variance of the gyroscope's bias, in (rad/s)², the same for all steps
        seconds:     duration of the step
        """
        lasted, known = self._slow_slip(innovation * seconds, noise * seconds**2, bias, seconds), self._slips
        self._slips_slowly = lasted > 0.0
        self._slips = self._slips_slowly or innovation**2 > GATE * (noise + bias)
        if not self._slips:
            return 0.0
        return seconds if known else max(seconds, lasted)

    def _slow_slip(self, innovation: float, noise: float, bias: float, seconds: float) -> float:
        """Return the time in s over which the sum of the innovations exceeds its gate; 0 if it does not."""
        self._recent.append((innovation, noise, seconds))
        window, gate = (RELEASE_S, RELEASE_GATE) if self._slips_slowly else (WINDOW_S, WINDOW_GATE)
        while len(self._recent) > 1 and sum(step[2] for step in self._recent) > window + 1e-9:
            self._recent.popleft()
        total, variance, lasted = map(sum, zip(*self._recent, strict=True))
        return lasted if total**2 > gate * (variance + bias * lasted**2) else 0.0
