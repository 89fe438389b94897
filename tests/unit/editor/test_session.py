"""Tests of the data that the editor page gets about a text: objects on the map, problems, forms, and paths."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from simscen.cli.session.stacks import Stacks
from simscen.core.external_command import ExternalCommand
from simscen.editor.document import EditedFile
from simscen.editor.session import EditorSession, RequestRefused
from simscen.editor.trial_run import TrialRun
from simscen.loading.loaded import LoadedScenario
from simscen.loading.stacks.choice import StackChoice
from simscen.run.process.jobs import Backend

TEXT = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]
  obstacles: [{name: rack, cylinder: [50 cm, 1], pose: {x: 4, y: 4}}]
  objects: [{name: cart, box: [1, 0.5, 1], pose: {x: 2, y: 4}, move: {through: [[3, 4]], speed: 1 m/s}}]
  places: {dock: {x: 1, y: 1, yaw: 90 deg}}
  regions: {lane: [[3, 0.5], [5, 0.5], [5, 2]]}
robot: {pose: dock}
goals: [dock, {pose: {x: 7, y: 2}}]
stack: {keepout: [lane]}
events:
  - when: {any: [{robot_in: {region: lane}}, {robot_within: {of: dock, distance: 1}}]}
    do: [{pedestrian: {name: anna, pose: {x: 8, y: 4}, goals: [dock]}}, {mark: {name: here}}]
    then:
      - do: {kidnap: {pose: {x: 3, y: 3}}}
faults:
  - {sensor: lidar, off: {}, when: {robot_within: {object: cart, distance: 2 m}}, for: 1 s}
pass: [goals_reached: {}]
"""
RUNNABLE = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 3, y: 1}}]
stack: {profile: advanced}
pass: [goals_reached: {}]
"""
SessionFactory = Callable[..., EditorSession]


@pytest.fixture
def make_session(tmp_path: Path) -> Iterator[SessionFactory]:
    """Return a function that opens a text in an editor session."""
    sessions: list[EditorSession] = []

    def make(text: str = TEXT, name: str = "a.scenario.yaml", kind: str = "scenario") -> EditorSession:
        (tmp_path / name).write_text(text)
        sessions.append(EditorSession(EditedFile(tmp_path / name, kind, tmp_path), _no_backend))
        return sessions[-1]

    yield make
    for session in sessions:
        session.runs.close()


def _no_backend() -> Backend:
    raise AssertionError("no run starts in these tests")


def map_objects(session: EditorSession, text: str = TEXT) -> dict[str, Any]:
    """Return the objects on the map of a text by id, such as `goals/0`."""
    return {item["id"]: item for item in session.scene({"text": text})["objects"]}


def test_every_object_with_a_pose_is_on_the_map(make_session: SessionFactory) -> None:
    objects = map_objects(make_session())
    positions = {
        name: [(handle["x"], handle["y"]) for handle in item["handles"]]
        for name, item in objects.items()
        if item["handles"]
    }
    assert positions == {
        "robot": [(1, 1)],
        "goals/0": [(1, 1)],
        "goals/1": [(7, 2)],
        "events/0/when/any/1/robot_within": [(1, 1)],
        "events/0/do/0/pedestrian": [(8, 4), (1, 1)],
        "events/0/then/0/do/kidnap": [(3, 3)],
        "world/walls/0": [(0, 0), (9, 0), (9, 5), (0, 5), (0, 0)],
        "world/obstacles/0": [(4, 4)],
        "world/objects/0": [(2, 4)],
        "world/objects/0/move": [(3, 4)],
        "world/places/dock": [(1, 1)],
        "world/regions/lane": [(3, 0.5), (5, 0.5), (5, 2)],
    }
    assert objects["events/0/when/any/0/robot_in"]["region"] == "lane"
    assert objects["stack/keepout/0"]["region"] == "lane"
    assert objects["faults/0/when/robot_within"]["follows"] == "cart"
    assert objects["world/obstacles/0"]["parts"][0][0] == [0.5, 0]
    assert objects["world/objects/0/move"]["origin"] == (2, 4)
    assert objects["robot"]["handles"][0]["place"] == "dock"
    assert all(item["editable"] for item in objects.values())
    assert objects["goals/0"]["at"] == 10 and objects["world/regions/lane"]["at"] == 8


def test_a_text_with_mistakes_still_has_a_map(make_session: SessionFactory) -> None:
    session = make_session()
    objects = map_objects(session, TEXT.replace("x: 7, y: 2", "x: seven, y: 2").replace("speed: 1 m/s", "speed: fast"))
    assert objects["goals/1"]["handles"] == [] and objects["goals/0"]["handles"]
    with pytest.raises(RequestRefused, match="not a YAML mapping"):
        session.scene({"text": "a: [1"})
    half_written = TEXT.replace("through: [[3, 4]], speed: 1 m/s", "keyframes: [5, [], [1, 3, 4, 0]]")
    path = map_objects(session, half_written)["world/objects/0/move"]
    assert [handle["keys"][-1] for handle in path["handles"]] == [2]


def test_problems_refer_to_objects_on_the_map(make_session: SessionFactory) -> None:
    session = make_session()
    (note,) = session.problems({"text": TEXT})["problems"]
    assert (note["severity"], note["object"], note["where"]) == ("warning", "goals/0", "10:9")
    problems = session.problems({"text": TEXT.replace("x: 7, y: 2", "x: 4, y: 4")})["problems"]
    errors = [problem for problem in problems if problem["severity"] == "error"]
    assert [(problem["code"], problem["object"], problem["where"]) for problem in errors] == [
        ("SC301", "goals/1", "10:22")
    ]
    problems = session.problems({"text": TEXT.replace("distance: 1}", "distence: 1}")})["problems"]
    assert {problem["object"] for problem in problems} == {"events/0/when/any/1/robot_within"}
    assert session.problems({"text": "a: [1"})["problems"][0]["code"] == "SC003"


@pytest.mark.parametrize("line_break", ["\r", "\x85", "\u2028", "\u2029"])
def test_lines_of_problems_are_counted_as_in_yaml(make_session: SessionFactory, line_break: str) -> None:
    text = f"# one{line_break}# two\n" + TEXT.replace("distance: 1}", "distence: 1}")
    problems = make_session().problems({"text": text})["problems"]
    assert {problem["object"] for problem in problems} == {"events/0/when/any/1/robot_within"}


def test_the_kind_of_a_fault_or_criterion_is_not_one_of_its_modifiers(make_session: SessionFactory) -> None:
    text = TEXT.replace("{sensor: lidar, off: {}, ", "{for: 1 s, sensor: lidar, required: false, off: {}, ").replace(
        "for: 1 s}\n", "}\n"
    )
    objects = map_objects(
        make_session(), text.replace("pass: [", "pass: [{severity: warn, then: [], collisions: {max: 0}}, ")
    )
    assert (objects["faults/0"]["label"], objects["pass/0"]["label"]) == ("lidar off", "collisions")


def test_a_form_shows_a_number_that_is_not_finite_as_text(make_session: SessionFactory) -> None:
    text = TEXT.replace("speed: 1 m/s", "speed: 1 m/s, repeat: .nan")
    form = make_session().form({"text": text, "keys": ["world", "objects", 0, "move"]})
    assert [field["value"] for field in form["fields"] if field["key"] == "repeat"] == ["nan"]


@pytest.mark.parametrize("keys", [None, [{}], [[1]], [-1], [None]])
def test_a_form_needs_a_list_of_keys(make_session: SessionFactory, keys: Any) -> None:
    with pytest.raises(RequestRefused, match="no list of keys"):
        make_session().form({"text": TEXT, "keys": keys})


def test_problem_is_not_assigned_to_another_object_in_the_same_line(make_session: SessionFactory) -> None:
    text = TEXT.replace("goals: [dock, ", "goals: [{name: first one, pose: {x: 4, y: 4.0}}, {pose: {x: 6, y: 2}}, ")
    problems = make_session().problems({"text": text})["problems"]
    assert [problem["object"] for problem in problems] == ["goals/0"]


def test_moving_an_object_at_a_place_writes_a_pose(make_session: SessionFactory) -> None:
    session = make_session()

    def moved(keys: list[Any], **to: float) -> str:
        return str(session.edit({"text": TEXT, "edits": [{"op": "pose", "keys": keys, **to}]})["text"])

    assert moved(["robot", "pose"], x=2, y=1.5, yaw=0) == TEXT.replace(
        "pose: dock}\ngoals", "pose: {x: 2, y: 1.5}}\ngoals"
    )
    assert moved(["goals", 0, "pose"], x=2, y=3) == TEXT.replace("goals: [dock, {", "goals: [{pose: {x: 2, y: 3}}, {")
    point = {"op": "point", "keys": ["events", 0, "do", 0, "pedestrian", "goals", 0], "x": 2, "y": 3}
    assert session.edit({"text": TEXT, "edits": [point]})["text"] == TEXT.replace(
        "goals: [dock]}}", "goals: [[2, 3]]}}"
    )


def test_paths_and_clearances_are_updated_after_edits(make_session: SessionFactory) -> None:
    session = make_session()
    preview = session.preview({"text": TEXT, "edits": []})["robots"]["robot"]
    assert [leg["length"] for leg in preview["legs"]] == [0, 6.08]
    near_obstacle = session.preview(
        {"text": TEXT, "edits": [{"op": "pose", "keys": ["goals", 1, "pose"], "x": 4, "y": 4.2}]}
    )
    assert near_obstacle["robots"]["robot"]["legs"][1]["length"] is None
    assert near_obstacle["robots"]["robot"]["clearances"][2] < 0
    assert session.preview({"text": TEXT + "raduis: 1\n"})["reason"].startswith(
        "No path is shown until this is corrected"
    )


def test_path_avoids_a_dragged_obstacle_at_its_new_position(make_session: SessionFactory) -> None:
    session = make_session()
    moved = [{"op": "pose", "keys": ["world", "obstacles", 0, "pose"], "x": 4.0, "y": 1.5}]
    length = session.preview({"text": TEXT, "edits": moved})["robots"]["robot"]["legs"][1]["length"]
    assert length > 6.1


def fields(form: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the fields of a form by key."""
    return {field["key"]: field for field in form["fields"]}


def test_a_form_has_the_help_and_the_choices_of_the_schema(make_session: SessionFactory) -> None:
    session = make_session()
    form = session.form({"text": TEXT, "keys": ["events", 0, "do", 0, "pedestrian"]})
    assert form["help"].startswith("Add a person who walks to goals and avoids walls")
    assert fields(form)["name"]["type"] == "text" and fields(form)["name"]["required"]
    offered = {key_form["key"]: key_form for key_form in form["addable"]}
    assert offered["behavior"]["value"] == "regular" and "Reaction to the robot" in offered["behavior"]["help"]
    form = session.form({"text": TEXT, "keys": ["world", "obstacles", 0]})
    assert fields(form)["cylinder"]["fields"][0]["value"] == "50 cm"
    assert fields(form)["cylinder"]["fields"][0]["example"] == "1.5 m"
    form = session.form({"text": TEXT, "keys": ["faults", 0]})
    assert "noise" not in {key_form["key"] for key_form in form["addable"]}, "a fault has exactly one kind"


def test_every_form_offers_only_keys_that_the_file_accepts(make_session: SessionFactory) -> None:
    session = make_session()
    for map_object in map_objects(session).values():
        form = session.form({"text": TEXT, "keys": map_object["keys"]})
        for offered in form.get("addable", []):
            edit = {"op": "set", "keys": [*map_object["keys"], offered["key"]], "value": offered["value"]}
            text = session.edit({"text": TEXT, "edits": [edit]})["text"]
            codes = {problem["code"] for problem in session.problems({"text": text})["problems"]}
            assert not codes & {"SC003", "SC011", "SC012", "SC013", "SC014", "SC015"}, (
                map_object["id"],
                offered,
                codes,
            )


def test_values_of_a_base_file_are_shown_and_can_be_overridden(make_session: SessionFactory, tmp_path: Path) -> None:
    (tmp_path / "hall.base.yaml").write_text(TEXT)
    text = "extends: hall.base.yaml\nname: mine\n"
    session = make_session(text)
    objects = map_objects(session, text)
    assert objects["robot"]["editable"] and not objects["goals/1"]["editable"]
    moved = session.edit({"text": text, "edits": [{"op": "pose", "keys": ["robot", "pose"], "x": 2, "y": 1, "yaw": 0}]})
    assert moved["text"] == f"{text}robot: {{pose: {{x: 2, y: 1}}}}\n"
    with pytest.raises(RequestRefused, match="not written out in this file"):
        session.edit({"text": text, "edits": [{"op": "pose", "keys": ["goals", 1, "pose"], "x": 2, "y": 1}]})


def test_a_scenario_with_problems_does_not_run(make_session: SessionFactory) -> None:
    with pytest.raises(RequestRefused, match="inside obstacle"):
        make_session().run({"text": TEXT.replace("x: 7, y: 2", "x: 4, y: 4")})


def test_run_uses_the_stack_of_the_option_instead_of_the_stack_of_the_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(RUNNABLE)
    program = ExternalCommand(("drive",), {}, str(tmp_path))
    stacks = Stacks((StackChoice("mine", "drive", external_command=program),))
    file = EditedFile(tmp_path / "a.scenario.yaml", "scenario", tmp_path)
    session = EditorSession(file, _no_backend, stack=stacks.choices[0], resolve_commands=stacks.with_command)
    started: list[LoadedScenario] = []

    def start(loaded: LoadedScenario) -> TrialRun:
        started.append(loaded)
        return TrialRun(1, tmp_path, 60.0)

    monkeypatch.setattr(session.runs, "start", start)
    assert session.open({})["stack"] == "mine"
    session.run({"text": RUNNABLE})
    assert [(loaded.stack, loaded.external_command) for loaded in started] == [("mine=drive", program)]
