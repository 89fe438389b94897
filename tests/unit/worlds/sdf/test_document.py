"""Tests of SDF files: XML, size limits, unknown elements, and names."""

import difflib
import tracemalloc
from pathlib import Path

import pytest

from simscen.assets import markup
from simscen.core.errors import InvalidInput
from simscen.worlds.sdf import load_sdf

BOX = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"
LINK = f"<link name='a'>{BOX}</link>"
MODEL = f"<model name='m'><static>1</static>{LINK}</model>"

BOMB = """<?xml version="1.0"?>
<!DOCTYPE sdf [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<sdf version="1.6"><world name="&b;"/></sdf>"""


def test_a_doctype_is_refused(refuse):
    (problem,) = refuse(BOMB)
    assert (problem.path, problem.line, problem.message) == ("shop.world", 2, "DOCTYPE not allowed")


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("<sdf version='1.6'>\n<world name='w'>\n<model", 3, "not well-formed XML: unclosed token"),
        ("<?xml version='1.0'?>\n", 2, "not well-formed XML: no element found"),
        ("<?xml version='1.0' encoding='klingon'?><sdf/>", 1, "cannot be read as XML"),
        ("<?xml version='1.0'?>\n" + "<a>" * 200_000, 2, "nested deeper than 100"),
        ("<sdf version='1.9'>\n</sdf>", 1, "contains neither a world nor a model"),
        ("<sdf version='1.99'><world name='w'/></sdf>", 1, "SDF version 1.99 is not read"),
        (f"<sdf version='1.{'1' * 5000}'><world name='w'/></sdf>", 1, "SDF version 1.1111"),
    ],
)
def test_invalid_sdf_is_refused_with_a_line(refuse, content, line, message):
    (problem,) = refuse(content)
    assert problem.line == line
    assert message in problem.message


def test_world_of_stage_has_a_hint(tmp_path):
    (tmp_path / "x.world").write_text('floorplan( bitmap "cave.png" size [16 16 0.8] )\n')
    with pytest.raises(InvalidInput, match="not well-formed XML") as caught:
        load_sdf(tmp_path / "x.world", root=tmp_path)
    assert "a world of Stage is not, so use its floor plan as a ROS map" in caught.value.problems[0].hint


def test_binary_files_are_refused(tmp_path):
    (tmp_path / "x.world").write_bytes(bytes(range(256)))
    with pytest.raises(InvalidInput, match="not well-formed XML"):
        load_sdf(tmp_path / "x.world", root=tmp_path)


def test_the_number_of_elements_is_limited(refuse, monkeypatch):
    monkeypatch.setattr(markup, "MAX_ELEMENTS", 1000)
    (problem,) = refuse("<sdf version='1.9'>" + "<a/>" * 1000)
    assert "more than 1000 elements" in problem.message


def test_repeated_unknown_element_is_looked_up_once(tmp_path, monkeypatch):
    lookups = []
    real = difflib.get_close_matches
    counting = lambda word, *arguments, **options: lookups.append(word) or real(word, *arguments, **options)  # noqa: E731
    monkeypatch.setattr(difflib, "get_close_matches", counting)
    (tmp_path / "x.world").write_text(
        f"<sdf version='1.6'><world name='w'>{MODEL}{'<never_heard_of/>' * 1000}</world></sdf>"
    )
    load_sdf(tmp_path / "x.world", root=tmp_path)
    assert lookups == ["never_heard_of"]


def test_files_beyond_20_mib_are_refused_without_being_read(tmp_path):
    with (tmp_path / "x.world").open("wb") as file:
        file.truncate(100 * 2**20)
    tracemalloc.start()
    with pytest.raises(InvalidInput, match="larger than 20 MiB"):
        load_sdf(tmp_path / "x.world", root=tmp_path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 21 * 2**20


@pytest.mark.parametrize("make", [Path.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_a_world_must_be_a_file_inside_the_root(tmp_path, make):
    make(tmp_path / "x.world")
    with pytest.raises(InvalidInput, match=r"not a regular file|outside the scenario root"):
        load_sdf(tmp_path / "x.world", root=tmp_path)


def test_a_missing_world_is_reported(tmp_path):
    with pytest.raises(InvalidInput, match=r"x\.world: no such file or directory"):
        load_sdf(tmp_path / "x.world", root=tmp_path)


def test_several_mistakes_are_reported_together_in_file_order(refuse):
    invalid = LINK.replace("1 1 1", "1 0 1")
    problems = refuse(f"<model name='m'>{invalid}</model>\n<population name='p'/>\n<include/>\n{MODEL}")
    assert [problem.line for problem in problems] == [2, 3, 4]


@pytest.mark.parametrize(
    ("world", "message", "hint"),
    [
        (MODEL.replace("collision", "colision"), "unknown element <colision>", "did you mean <collision>?"),
        (f"<modle name='x'>{LINK}</modle>", "unknown element <modle>", "did you mean <model>?"),
        (f"<group>{MODEL}</group>", "unknown element <group>", ""),
        (MODEL.replace("box", "bocks"), "<bocks> is not a shape that is read", "one of box, cylinder"),
        (f"<xacro:if value='$(arg x)'>{MODEL}</xacro:if>", "<xacro:if> is not expanded", "expand it"),
        (MODEL.replace("static>", "statik>"), "unknown element <statik>", "did you mean <static>?"),
        (MODEL.replace("</size>", "</size><pos>1 0 0</pos>"), "unknown element <pos>", ""),
        (MODEL.replace("<geometry>", "<poze>1 0 0</poze><geometry>"), "unknown element <poze>", "did you mean <pose>?"),
        ("<xacro:shelf x='1'/>", "<xacro:shelf> is not expanded", "expand it"),
    ],
)
def test_unknown_elements_that_may_hold_geometry_are_errors(refuse, world, message, hint):
    problem = refuse(f"<sdf version='1.9' xmlns:xacro='x'><world name='w'>{MODEL}{world}</world></sdf>")[0]
    assert message in problem.message
    assert problem.hint.startswith(hint)


def test_unknown_elements_without_geometry_leave_a_note(load):
    world = load(f"<wheather>rain</wheather><scens/>{MODEL}")
    assert world.notes == (
        "shop.world: world[w]/wheather: unknown element <wheather> ignored",
        "shop.world: world[w]/scens: unknown element <scens> ignored; did you mean <scene>?",
    )


def test_lights_plugins_extensions_and_xacro_definitions_are_ignored(load):
    harmless = (
        "<light name='sun' type='directional'/><plugin name='p' filename='f'><model/></plugin><gz:extra/>"
        "<xacro:property name='x' value='1'/><xacro:unless value='1'><plugin/></xacro:unless>"
    )
    world = load(f"<sdf version='1.9' xmlns:xacro='x' xmlns:gz='y'><world name='w'>{harmless}{MODEL}</world></sdf>")
    assert len(world.solids) == 1
    assert not world.notes


def test_world_has_the_name_and_bounds_of_the_file(load):
    world = load(MODEL.replace("1 1 1", "2 4 1"))
    assert world.name == "w"
    assert world.bounds == pytest.approx((-1, -2, 1, 2))


def test_file_with_only_models_is_a_world(load):
    other = MODEL.replace("'m'", "'n'")
    world = load(f"<sdf version='1.7'>{MODEL}{other}</sdf>")
    assert (world.name, len(world.solids)) == ("shop", 2)


def test_loading_twice_gives_equal_worlds(load):
    text = MODEL + MODEL.replace("'m'", "'n'").replace("<static>1</static>", "")
    first, second = load(text), load(text)
    assert (first.solids, first.bodies, first.notes) == (second.solids, second.bodies, second.notes)


def test_messages_contain_no_control_characters_and_shorten_long_names(refuse):
    for name in ("a\u202eb", "x" * 100_000):
        (problem,) = refuse(MODEL.replace("1 1 1", "1 1").replace("'c'", f"'{name}'"))
        assert problem.message.isprintable()
        assert len(problem.message) < 300


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "<model> has no name"),
        ("x" * 121, "longer than 120"),
        ("a&#x1b;b", "not well-formed"),
        ("a&#x202e;b", "control character"),
    ],
)
def test_names_are_checked(refuse, name, message):
    assert message in refuse(MODEL.replace("'m'", f"'{name}'"))[0].message
