"""Module of another package, with a valid criterion and invalid ones."""

import pytest

CALM = '''
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveSpeed


class Calm(Spec, Criterion):
    """Calm at the wheel."""

    max: PositiveSpeed = 1.0
    """Meters per second."""

    def judge(self, trace, case) -> list[Finding]:
        """One bound."""
        return [at_most("calm", 0.5, self.max, "m/s")]


class Vague(Spec, Criterion):
    """It never says what it means."""


class Lax:
    """No specification."""


class Stranger(Spec):
    """A specification, but no criterion."""
'''


@pytest.fixture
def calm_module() -> str:
    """The text of that module."""
    return CALM


@pytest.fixture
def calm(packages) -> None:
    """A package that adds the criterion `calm`."""
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=CALM)
