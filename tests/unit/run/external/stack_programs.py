"""Programs that tests use as external stacks."""

DRIVE = """\
for step in peer:
    odom, goal = step.get("/odom"), peer.goals.accept()
    is_at_desk = odom is not None and odom.pose.x > 0.9
    if goal and is_at_desk:
        peer.goals.reached()
    step.drive(0.0 if is_at_desk or not goal else 0.4, 0.0)
"""
"""Drives 1 m straight ahead to the goal `desk`."""
