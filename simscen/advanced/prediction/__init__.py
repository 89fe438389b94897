"""Motion prediction: tracking of moving obstacles in lidar scans, and avoidance of them."""
