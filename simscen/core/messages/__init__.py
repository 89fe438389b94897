"""Data that the simulator and a navigation stack exchange: sensor data, goals, pose estimates."""
