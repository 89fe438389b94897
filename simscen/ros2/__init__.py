"""The adapter between the stack protocol and a ROS 2 graph: it runs under the user's own ROS Python, 3.8 or newer.

Nothing here imports anything of simscen but `simscen.peer`, nor any package but rclpy and messages. `start.py` is what
is run; it makes this folder importable without the rest of simscen.
"""
