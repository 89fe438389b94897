"""What a robot did when it was driven once, as a table and as JSON."""

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simscen.run.robotcheck import Check, Checked
    from simscen.run.trialdrive import Motion, Trial
    from simscen.sim.robot_body import RobotBody


def as_table(body: "RobotBody", checked: "Checked") -> Iterator[str]:
    """At most 80 columns: what was driven, then every check with its figure and its limit."""
    drive = body.drive.type.replace("_", " ")
    yield f"  {drive}, {body.mass:.4g} kg, {len(body.wheels)} wheels"
    slope, step = checked.climb
    if slope:
        yield f"  climbs {math.degrees(slope):.1f}° and a step of {1000 * step:.0f} mm, on dry concrete (closed forms)"
    yield ""
    yield f"  {'':9}{'driven in m':^24}{'turned in degrees':^25}  odometry   most"
    yield f"  {'':9}{'command odometry   truth'}  {'command odometry  truth'}  off at end  tilt"
    yield from map(_row, checked.trials)
    yield ""
    yield from map(_line, checked.checks)
    yield ""
    yield (
        f"{checked.failed} of {len(checked.checks)} checks failed"
        if checked.failed
        else (f"all {len(checked.checks)} checks held")
    )


def _row(trial: "Trial") -> str:
    motions = (trial.command, trial.odometry, trial.truth)
    driven = " ".join(f"{motion.driven:7.3f}" for motion in motions)
    turned = " ".join(f"{_degrees(motion.turned):7.1f}" for motion in motions)
    gap = trial.odometry.end.distance(trial.truth.end)
    return f"  {trial.name:9} {driven}  {turned}   {gap:7.3f} m  {math.degrees(trial.tilt):4.1f}"


def _line(check: "Check") -> str:
    verdict = "ok" if check.held else "FAILED"
    told = f"  {verdict:7} {check.name:36} {check.value:9.3f}, at most {check.limit:.3g} {check.unit}"
    return told if check.held or not check.advice else f"{told}\n          {check.advice}"


def as_data(body: "RobotBody", checked: "Checked") -> dict[str, Any]:
    """All figures, angles in rad and lengths in m as far as no unit is beside them; ways without their poses."""
    return {
        "robot": body.name,
        "drive": body.drive.type,
        "passed": not checked.failed,
        "climb": {"slope": checked.climb.slope, "step": checked.climb.step},
        "rest": asdict(checked.rest),
        "trials": [_trial(trial) for trial in checked.trials],
        "checks": [{**asdict(check), "held": check.held} for check in checked.checks],
    }


def _trial(trial: "Trial") -> dict[str, Any]:
    motions = {name: _motion(getattr(trial, name)) for name in ("command", "odometry", "truth")}
    return {"name": trial.name, **motions, "tilt": trial.tilt}


def _motion(motion: "Motion") -> dict[str, Any]:
    return {"driven": motion.driven, "turned": motion.turned, "end": motion.end._asdict()}


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), 1) + 0.0  # no minus before a zero
