"""Header of a log, built once for all runs of a scenario."""

from dataclasses import replace
from weakref import WeakKeyDictionary

from simscen.loading.plugins import fact_of, requirement_of
from simscen.loading.resolved import resolved_text
from simscen.record.header import CHOSEN, STACK_NAME, VARIATION, LogHeader
from simscen.record.sceneryfile import NAME as SCENERY
from simscen.record.sceneryfile import scenery_to_json
from simscen.run.preparation.scenario import PreparedScenario
from simscen.run.preparation.scenery import world_scenery
from simscen.run.robot_interface import sensor_frames, sensor_kinds
from simscen.sim.urdf.describe import describe

_KNOWN: WeakKeyDictionary[PreparedScenario, LogHeader] = WeakKeyDictionary()


def log_header(prepared: PreparedScenario, seed: int) -> LogHeader:
    """Return the log header of a run."""
    known = _KNOWN.get(prepared)
    if known is None:
        known = _KNOWN[prepared] = _of_all_runs(prepared)
    return replace(known, seed=seed, robots={name: replace(one, seed=seed) for name, one in known.robots.items()})


def _of_all_runs(prepared: PreparedScenario) -> LogHeader:
    robots = {name: _of_one(part) for name, part in prepared.robots.items()}
    return replace(_of_one(prepared), files={SCENERY: scenery_to_json(world_scenery(prepared))}, robots=robots)


def _of_one(prepared: PreparedScenario) -> LogHeader:
    return LogHeader(
        name=prepared.loaded.id,
        seed=prepared.spec.seed,
        case=prepared.case,
        scenario=resolved_text(prepared.loaded),
        map=prepared.map,
        robot_description=describe(prepared.body),
        frames=sensor_frames(prepared.robot),
        sensors=sensor_kinds(prepared),
        facts={**_key_facts(prepared), **{fact_of(entry): requirement_of(entry) for entry in prepared.plugins}},
    )


def _key_facts(prepared: PreparedScenario) -> dict[str, str]:
    """Return the stack chosen on the command line, and the names of stack and variation."""
    loaded = prepared.loaded
    told = {CHOSEN: loaded.stack, STACK_NAME: loaded.stack_name, VARIATION: loaded.variation}
    return {name: value for name, value in told.items() if value}
