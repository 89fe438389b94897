"""Shadows tf2_msgs, as if this ROS did not have the package."""

raise ModuleNotFoundError("No module named 'tf2_msgs'", name="tf2_msgs")
