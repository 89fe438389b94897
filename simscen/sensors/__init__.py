"""What the robot is told of the world: lidar, odometry, IMU, bumper, camera, each with its own noise."""
