"""What only building a robot can tell of its file."""

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.robotfile import RobotFile
from simscen.run.worldsource import robot_of
from simscen.sim.ground import refuse_dragging


def problems_once_built(file: RobotFile) -> list[Problem]:
    """Why a robot cannot be used, or warnings about it; one of simple shapes need not be built."""
    robot = file.robot
    try:
        if robot.urdf is not None:
            from simscen.run.robotgeometry import geometry_notes

            spec, body = robot_of(robot, file.roots)
            found = geometry_notes(robot, spec, body, file.roots)
        else:
            assert robot.spec is not None  # a robot has one or the other
            refuse_dragging(robot.spec, robot.path)
            found = []
    except InvalidInput as error:
        found = error.problems
    return file.library.with_source_where_missing(found)
