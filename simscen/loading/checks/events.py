"""Checks for events and faults with triggers that never fire, or fire less often than specified."""

from collections.abc import Iterator

from simscen.loading.checks.possible_run import earliest_true_s, possible_run, stays_true
from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.loaded import LoadedScenario


@MEANING.check("SC050")
def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults that can never happen. With `required: false`, the problem is only a warning."""
    run = possible_run(loaded)
    for keys, trigger, name, required in run.triggers:
        if trigger is not None and (reason := run.why_never(trigger, keys)):
            yield CheckProblem(reason[0], f"`{name}` can never happen: {reason[1]}", warning=not required)


@MEANING.check("SC052", severity="warning")
def triggers_that_fire_once(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults with `times` above 1 that can happen only once."""
    run = possible_run(loaded)
    for keys, trigger, name, _ in run.triggers:
        if trigger is None or trigger.times == 1 or trigger.edge != "rising" or not stays_true(trigger):
            continue
        if run.why_never(trigger, keys) is None:
            message = f"`{name}` happens once, not {trigger.times} times: its condition stays true"
            yield CheckProblem((*keys, "times"), message)
    for index, fault in enumerate(loaded.spec.faults):
        if fault.when is not None and fault.when.times > 1 and fault.for_ is None:
            message = f"`{fault.label}` happens once, not {fault.when.times} times: without `for` it lasts to the end"
            yield CheckProblem(("faults", index, "when", "times"), message, "add `for`: how long it lasts")


@MEANING.check("SC050")
def impossible_steps(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find steps of a sequence that can only happen after the time limit, or that wait again for an earlier step."""
    run = possible_run(loaded)
    limit, earliest = loaded.spec.time_limit, dict[int, float]()
    for number, step in enumerate(run.steps):
        own = 0.0 if step.when is None or step.when.edge == "falling" else step.when.delay + earliest_true_s(step.when)
        earliest[number] = own + (0.0 if step.after is None else earliest[step.after])
        if step.after is None or not run.is_reachable(step) or step.when is None:
            continue
        keys = (*step.keys, "when")
        if earliest[number] >= limit > own and earliest[step.after] < limit:
            reason = f"its sequence takes at least {earliest[number]:g} s, but the time limit is {limit:g} s"
            yield CheckProblem(keys, f"`{step.name}` can never happen: {reason}", warning=not step.required)
        for part in step.when.parts():
            name = getattr(part.event, "name", None)
            if name in run.earlier_steps(step):
                message = f"`{step.name}` waits for `{name}`, which has already happened; a step waits for new events"
                yield CheckProblem(keys, message, warning=not step.required)
