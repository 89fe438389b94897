#!/usr/bin/env bash
# Build the parts of Nav2 (Jazzy) whose loops run on wall time again, with loops on ROS time: ros_time.sh PREFIX
#
# Nav2's own change is navigation2#6063 (April 2026; Lyrical and main), which does not apply to Jazzy. The result lies in
# PREFIX/ros_time over what build.sh made, and PREFIX/env_ros_time.sh is to be sourced instead of env.sh.
set -eu
source "$(dirname "$0")/cmake.sh"
PREFIX=$(cd "$1" && pwd)
OVERLAY=$PREFIX/ros_time VENV=$PREFIX/venv
source "$PREFIX/env.sh"
export CMAKE_PREFIX_PATH=$PREFIX/install:$PREFIX/venv:$PREFIX/venv/lib/python3.11/site-packages

replace() { # FILE OLD NEW: replace text that must be there
  grep -qF "$2" "$OVERLAY/src/$1" || { echo "$1 does not contain '$2'" >&2; exit 1; }
  sed -i "s|$2|$3|" "$OVERLAY/src/$1"
}
mkdir -p "$OVERLAY/src" "$OVERLAY/lib"
for package in nav2_behavior_tree nav2_behaviors nav2_controller nav2_costmap_2d nav2_velocity_smoother; do
  rm -rf "$OVERLAY/src/$package"
  cp -r "$PREFIX/src/nav2/$package/$package" "$OVERLAY/src/"
done
replace nav2_behavior_tree/src/behavior_tree_engine.cpp 'WallRate loopRate(loopTimeout)' 'Rate loopRate(loopTimeout, clock_)'
replace nav2_behaviors/include/nav2_behaviors/timed_behavior.hpp 'WallRate loop_rate(cycle_frequency_)' \
  'Rate loop_rate(cycle_frequency_, clock_)'
replace nav2_controller/src/controller_server.cpp 'WallRate loop_rate(controller_frequency_)' \
  'Rate loop_rate(controller_frequency_, get_clock())'
replace nav2_costmap_2d/src/costmap_2d_ros.cpp 'WallRate r(frequency)' 'Rate r(frequency, get_clock())'
replace nav2_velocity_smoother/src/velocity_smoother.cpp 'this->create_wall_timer(' \
  'rclcpp::create_timer(this, get_clock(), '

build() { # PACKAGE TARGET...
  local package=$1 started=$SECONDS; shift
  cmake_make "$OVERLAY/src/$package" "$OVERLAY" "$OVERLAY/build/$package" -- "$@"
  cp "$OVERLAY/build/$package"/*.so "$OVERLAY/lib/"
  echo "$package with ROS time: $((SECONDS - started)) s"
}
build nav2_costmap_2d nav2_costmap_2d_core
build nav2_behavior_tree nav2_behavior_tree
build nav2_controller controller_server_core
build nav2_velocity_smoother velocity_smoother_core
build nav2_behaviors install # Its plugins hold the loops, and are found by the path of the package.
{
  cat "$PREFIX/env.sh"
  echo "export LD_LIBRARY_PATH=$OVERLAY/lib:\$LD_LIBRARY_PATH AMENT_PREFIX_PATH=$OVERLAY:\$AMENT_PREFIX_PATH"
} > "$PREFIX/env_ros_time.sh"
