"""Nav2's velocity smoother and collision monitor."""

from collections.abc import Iterator
from typing import Any

from simscen.loading.nav2found import Found, Known, Parameters, strings


def velocity_smoother(node: str, parameters: Parameters, _: Known) -> Iterator[Found]:
    """Limits ahead, sideways and of the turn rate; here sideways is as ahead, and backward as forward."""
    for name, turning in (
        ("max_velocity", "max_angular_velocity"),
        ("max_accel", "max_angular_accel"),
        ("max_decel", ""),
    ):
        limits = _axes(parameters.get(name))
        for ours, limit in zip((name, turning), limits[::2], strict=True) if limits else ():
            if ours and limit:
                yield Found(node, name, ("velocity_smoother", ours), abs(limit))
        if limits and limits[1] and abs(limits[1]) != abs(limits[0]):
            yield Found(node, name, (), limits, "sideways is limited as ahead here")
    least, most = _axes(parameters.get("min_velocity")), _axes(parameters.get("max_velocity"))
    if least and most and all(low == -high or not low for low, high in zip(least, most, strict=True)):
        yield Found(node, "min_velocity", (), least)
    elif least:
        yield Found(node, "min_velocity", (), least, "backward is limited as forward here")
    faster, slower = _axes(parameters.get("max_accel")), _axes(parameters.get("max_decel"))
    if faster and slower and abs(slower[2]) != abs(faster[2]):
        yield Found(node, "max_decel", (), slower, "turning slower is limited as turning faster here")


def collision_monitor(node: str, parameters: Parameters, _: Known) -> Iterator[Found]:
    """Polygons that approach are here; those that stop, slow down or limit are not."""
    if "source_timeout" in parameters:
        yield Found(node, "source_timeout", ("collision_monitor", "source_timeout"), parameters["source_timeout"])
    on = parameters.get("enabled", True)
    approaching = []
    for polygon in strings(parameters.get("polygons")):
        action = parameters.get(f"{polygon}.action_type")
        if action != "approach":
            why = f"there is no polygon that does {action} here, as {polygon} does"
            yield Found(node, "polygons", (), action, why, covers=f"{polygon}.")
            continue
        yield from (Found(node, f"{polygon}.{said}", (), None) for said in ("action_type", "enabled"))
        approaching.append(parameters.get(f"{polygon}.enabled", True))
        yield from _approach(node, parameters, polygon)
    on = on and (any(approaching) or not approaching)
    for name in ("enabled", "polygons"):
        if name in parameters:
            yield Found(node, name, ("collision_monitor", "enabled"), on)
            break


def _approach(node: str, parameters: Parameters, polygon: str) -> Iterator[Found]:
    for theirs, ours, more in (
        ("time_before_collision", "time_before_collision", 0),
        ("max_points", "min_points", 1),  # Humble's: from one more on
        ("min_points", "min_points", 0),
    ):
        value = parameters.get(f"{polygon}.{theirs}")
        if value is not None:
            value = value + more if isinstance(value, int) and not isinstance(value, bool) else value
            yield Found(node, f"{polygon}.{theirs}", ("collision_monitor", ours), value)


def _axes(value: Any) -> list[float]:
    """Ahead, sideways and turning; what is no list of three numbers is none, which is told as not understood."""
    fits = isinstance(value, list) and len(value) == 3 and all(isinstance(one, int | float) for one in value)
    return value if fits else []
