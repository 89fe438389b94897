"""`turn_robot`: action that turns the robot in place."""

from simscen.plugin import Action, Angle, Effect, Pose2, Spec, Stage


class TurnRobot(Spec, Action):
    """Turn the robot on the spot; neither its stack nor its odometry gets to know it.

    Example: `do: {turn_robot: {by: 90 deg}}`
    """

    by: Angle
    """Counter-clockwise."""

    def perform(self, stage: Stage) -> Effect:
        """Turn it; nothing comes of no turn at all."""
        if self.by == 0:
            return Effect(False, "a turn of nothing turns nothing")
        here = stage.robot
        stage.place_robot(Pose2(here.x, here.y, here.yaw + self.by))
        return Effect(True, f"turned the robot by {self.by:.2f} rad")
