#!/usr/bin/env bash
# Start the servers of Nav2 in one process: compose.sh ENV PARAMS PYTHON
source "$1"
(node rclcpp_components component_container_isolated --ros-args -r __node:=nav2_container --params-file "$2") &
"$3" "$(dirname "$0")/compose.py" nav2_container "$2" || exit 1
wait
