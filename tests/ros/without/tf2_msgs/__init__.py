"""Stands in front of tf2_msgs: as if this ROS had none."""

raise ModuleNotFoundError("No module named 'tf2_msgs'", name="tf2_msgs")
