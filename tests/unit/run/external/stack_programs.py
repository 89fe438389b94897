"""Stacks of a few lines."""

DRIVE = """\
for step in peer:
    odom, goal = step.get("/odom"), peer.goals.accept()
    there = odom is not None and odom.pose.x > 0.9
    if goal and there:
        peer.goals.reached()
    step.drive(0.0 if there or not goal else 0.4, 0.0)
"""
"""Drives the meter to the desk."""
