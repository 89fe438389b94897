"""Stands in front of nav2_msgs: as if this ROS had none."""

raise ModuleNotFoundError("No module named 'nav2_msgs'", name="nav2_msgs")
