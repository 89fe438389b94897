"""The filters of filterpy are imported without scipy.stats, and work completely."""

import math
import subprocess
import sys

import pytest

BEFORE = "import sys; from simscen.stack.localizers.kalman_filters import KalmanFilter; "


def output_of(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip()


def test_scipy_stats_is_not_imported() -> None:
    assert output_of(BEFORE + "print('scipy.stats' in sys.modules, 'filterpy.stats' in sys.modules)") == "False False"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "code",
    [
        "f = KalmanFilter(1, 1); f.predict(); f.update(1.0); print(f.log_likelihood)",  # innovation 1, variance 1
        "import filterpy; print(filterpy.stats.logpdf(1.0, 0.0, 1.0))",
        "from filterpy.stats import logpdf; print(logpdf(1.0, 0.0, 1.0))",
    ],
    ids=["likelihood", "attribute", "import"],
)
def test_statistics_are_imported_on_first_use(code: str) -> None:
    assert float(output_of(BEFORE + code)) == pytest.approx(-0.5 * (math.log(2 * math.pi) + 1))  # of N(1; 0, 1)
