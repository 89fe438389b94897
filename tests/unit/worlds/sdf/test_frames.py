"""Tests of poses and frames in SDF worlds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.elements import parse
from simscen.worlds.sdf.frames import Frame, FrameScope

BOX = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"


def model(content: str, attributes: str = "") -> str:
    return f"<model name='m' {attributes}><static>1</static>{content}</model>"


def position(world, index=0):
    return world.solids[index].pose.position


def test_a_link_may_be_placed_relative_to_another_link(load):
    world = load(
        model(
            f"<pose>0 0 1 0 0 0</pose><link name='b'><pose relative_to='a'>1 0 0 0 0 0</pose>{BOX}</link>"
            "<link name='a'><pose degrees='true'>5 0 0 0 0 90</pose></link>"
        )
    )
    assert position(world) == pytest.approx((5, 1, 1))


def test_frame_is_placed_relative_to_its_attached_frame(load):
    world = load(
        model(
            "<link name='a'><pose>2 0 0 0 0 0</pose></link>"
            "<frame name='top' attached_to='a'><pose>0 0 3 0 0 0</pose></frame>"
            f"<link name='b'><pose relative_to='top'>1 0 0 0 0 0</pose>{BOX}</link>"
        )
    )
    assert position(world) == pytest.approx((3, 0, 3))


def test_joint_is_placed_relative_to_its_child_link_by_default(load):
    joint = "<joint name='j' type='fixed'><parent>world</parent><child>a</child><pose{}>0 0 1 0 0 0</pose></joint>"
    links = f"<link name='a'><pose>2 0 0 0 0 0</pose></link><link name='b'><pose relative_to='j'/>{BOX}</link>"
    assert position(load(model(links + joint.format("")))) == pytest.approx((2, 0, 1))
    assert position(load(model(links + joint.format(" relative_to='__model__'")))) == pytest.approx((0, 0, 1))


def test_a_collision_may_be_placed_relative_to_any_frame_of_its_model(load):
    moved = BOX.replace("<geometry>", "<pose relative_to='__model__'>0 0 1 0 0 0</pose><geometry>")
    world = load(
        f"<model name='m'><static>1</static><pose>9 0 0 0 0 0</pose>"
        f"<link name='a'><pose>2 3 0 0 0 1</pose>{moved}</link></model>"
    )
    np.testing.assert_allclose(world.solids[0].pose, Pose3(9, 0, 1), atol=1e-12)


def test_relative_to_may_name_frames_of_nested_models(load):
    world = load(
        model(
            "<model name='n'><pose>1 0 0 0 0 0</pose><link name='a'><pose>0 2 0 0 0 0</pose></link></model>"
            f"<link name='b'><pose relative_to='n::a'>0 0 3 0 0 0</pose>{BOX}</link>"
        )
    )
    assert position(world) == pytest.approx((1, 2, 3))


def test_models_may_be_placed_relative_to_frames_and_models_of_the_world(load):
    world = load(
        f"<model name='table'><static>1</static><pose>4 0 0 0 0 0</pose><link name='a'>{BOX}</link></model>"
        f"<model name='cup'><static>1</static><pose relative_to='table::a'>0 0 1 0 0 0</pose>"
        f"<link name='a'>{BOX}</link></model>"
    )
    assert position(world, 1) == pytest.approx((4, 0, 1))


def test_pose_of_a_model_applies_to_its_placement_frame(load):
    world = load(
        "<model name='m' placement_frame='foot'><static>1</static><pose>5 0 0 0 0 0</pose>"
        f"<link name='foot'><pose>1 0 2 0 0 0</pose></link><link name='a'>{BOX}</link></model>"
    )
    assert position(world) == pytest.approx((4, 0, -2))


def test_the_old_frame_attribute_means_relative_to(load):
    world = load(
        model(
            "<link name='a'><pose>2 0 0 0 0 0</pose></link>"
            f"<link name='b'><pose frame='a'>1 0 0 0 0 0</pose>{BOX}</link>"
        ),
        version="1.5",
    )
    assert position(world) == pytest.approx((3, 0, 0))


def test_poses_that_depend_on_each_other_are_refused(refuse):
    problems = refuse(
        model(
            f"\n<link name='a'><pose relative_to='b'>1 0 0 0 0 0</pose>{BOX}</link>"
            f"\n<link name='b'><pose relative_to='a'>1 0 0 0 0 0</pose>{BOX}</link>"
        )
    )
    assert problems[0].line == 3
    assert "depends on itself" in problems[0].message


def test_chain_of_a_thousand_frames_is_an_error(refuse):
    frames = "".join(f"<frame name='f{k + 1}' attached_to='f{k}'/>" for k in range(3000))
    (problem,) = refuse(model(f"<frame name='f0'/>{frames}<link name='a'><pose relative_to='f3000'/>{BOX}</link>"))
    assert "nested too deeply" in problem.message


numbers = st.floats(-5, 5).map(lambda x: round(x, 3))
poses = st.tuples(*[numbers] * 6)


@settings(max_examples=40, deadline=None)
@given(st.lists(poses, min_size=1, max_size=5))
def test_a_chain_of_frames_is_the_product_of_their_matrices(chain):
    text = "".join(
        f"<frame name='f{k}'><pose relative_to='{f'f{k - 1}' if k else ''}'>{' '.join(map(str, p))}</pose></frame>"
        for k, p in enumerate(chain)
    )
    root = parse(f"<m>{text}</m>".encode(), "x", ".")
    scope = FrameScope()
    for element in root.children:
        scope.add(Frame(element.name, element, element.child("pose")))
    matrix = np.eye(4)
    for pose in chain:
        matrix = matrix @ _matrix(pose)
    placed = scope.pose_of_name(f"f{len(chain) - 1}", root)
    np.testing.assert_allclose(placed.rotation(), matrix[:3, :3], atol=1e-9)
    np.testing.assert_allclose(placed.position, matrix[:3, 3], atol=1e-9)


def _matrix(pose):
    x, y, z, roll, pitch, yaw = pose
    result = np.eye(4)
    for (i, j), angle in zip(((0, 1), (2, 0), (1, 2)), (yaw, pitch, roll), strict=True):
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        result = result @ turn
    result[:3, 3] = x, y, z
    return result


def test_quaternions_are_read_as_xyzw_and_normalized(load):
    world = load(model(f"<link name='a'><pose rotation_format='quat_xyzw'>1 2 3 0 0 2 2</pose>{BOX}</link>"))
    np.testing.assert_allclose(world.solids[0].pose, (1, 2, 3, 0, 0, math.sqrt(0.5), math.sqrt(0.5)))


def test_a_pose_may_lack_its_yaw_if_roll_and_pitch_are_zero(load):
    world = load(model(f"<link name='a'><pose>1 2 3 0 -0.0</pose>{BOX}</link>"))
    assert world.solids[0].pose == (1, 2, 3, 0, 0, 0, 1)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ("<pose>1 2 3</pose>", "expected 6 numbers, got 3"),
        ("<pose>1 2 3 0 1.57</pose>", "expected 6 numbers, got 5"),
        ("<pose>1 2 3 0 0 nan</pose>", "must be a finite number"),
        ("<pose>1 2 3 0 0 1e400</pose>", "must be a finite number"),
        ("<pose>1 2 three 0 0 0</pose>", "expected a number, got 'three'"),
        ("<pose>${x} 2 0 0 0 0</pose>", "expected a number"),
        ("<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 0</pose>", "zero quaternion"),
        ("<pose rotation_format='quat_wxyz'>0 0 0 0 0 0 1</pose>", "unknown rotation_format"),
        ("<pose degrees='maybe'>0 0 0 0 0 0</pose>", "expected true or false"),
        ("<pose rotation_format='quat_xyzw' degrees='1'>0 0 0 0 0 0 1</pose>", "exclude each other"),
    ],
)
def test_a_wrong_pose_is_an_error_at_its_line(refuse, pose, message):
    problems = refuse(model(f"\n<link name='a'>\n{pose}{BOX}</link>"))
    assert (problems[0].line, problems[0].col) == (4, 1)
    assert message in problems[0].message
    assert problems[0].message.startswith("world[w]/model[m]/link[a]/pose: ")
