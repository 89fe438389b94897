"""A scenario as one self-contained text: what a log and an output folder keep of it."""

from simscen.core.errors import InvalidInput
from simscen.loading.compose import compose
from simscen.loading.loaded import LoadedScenario
from simscen.loading.tree import Fields
from simscen.loading.validation import check
from simscen.loading.writing import to_yaml
from simscen.model.scenario import ScenarioSpec


def resolved_text(loaded: LoadedScenario) -> str:
    """The file as it was written; where it `extends` others or takes `defaults.yaml`, all of them merged."""
    own, _ = compose(loaded.text, loaded.path)
    if isinstance(own, Fields) and own.plain == loaded.tree.plain:
        return loaded.text
    return to_yaml(loaded.tree.plain)


def spec_of_text(text: str, name: str) -> ScenarioSpec:
    """The specification in a resolved text; `name` is what problems call it. Raises InvalidInput."""
    tree, problems = compose(text, name)
    if tree is None or problems:
        raise InvalidInput(problems)
    spec = check(ScenarioSpec, tree)
    if isinstance(spec, list):
        raise InvalidInput(spec)
    return spec
