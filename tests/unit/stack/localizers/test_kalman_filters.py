"""Test that the filters of filterpy are imported without scipy.stats, which is imported at its first use."""

import math
import subprocess
import sys

import pytest

IMPORT_CODE = """
import sys
from simscen.stack.localizers.kalman_filters import KalmanFilter
print("scipy.stats" in sys.modules, "filterpy.stats" in sys.modules)
"""


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
def test_scipy_stats_is_not_imported_before_the_first_use_of_statistics(code: str) -> None:
    process = subprocess.run([sys.executable, "-c", IMPORT_CODE + code], check=True, capture_output=True, text=True)
    imported_modules, value = process.stdout.splitlines()
    assert imported_modules == "False False"
    assert float(value) == pytest.approx(-0.5 * (math.log(2 * math.pi) + 1))  # log of N(1; 0, 1)
