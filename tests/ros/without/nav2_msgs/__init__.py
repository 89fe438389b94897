"""Shadows nav2_msgs, as if this ROS did not have the package."""

raise ModuleNotFoundError("No module named 'nav2_msgs'", name="nav2_msgs")
