"""Adapter between simscen's stack protocol and a ROS 2 graph. It runs under the user's own ROS Python, 3.8 or newer.

Modules in this folder import nothing of simscen except `simscen.peer`, and no packages except rclpy and message
packages. `start.py` is the program; it makes this folder importable without the rest of simscen.
"""
