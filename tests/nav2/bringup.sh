#!/usr/bin/env bash
# Start the servers of Nav2 as separate processes: bringup.sh ENV PARAMS [ARGUMENT OF ROS...]
#
# ENV and PARAMS as `rig.py` describes them in rig.json. MANAGED = the navigation servers that become active.
# SMOOTHED=1 sends commands through the velocity smoother and the collision monitor, as nav2_bringup does.
source "$1"
params=$2
shift 2
common=("$@")
start() { # PACKAGE/EXECUTABLE [ARGUMENT OF ROS...]
  local server=$1; shift
  (node "${server%/*}" "${server#*/}" --ros-args --params-file "$params" "${common[@]}" "$@") &
}
manager() { # NAME NODES
  (node nav2_lifecycle_manager lifecycle_manager --ros-args -r __node:="lifecycle_manager_$1" -p use_sim_time:=true \
    -p autostart:=true -p bond_timeout:=0.0 -p node_names:="[$2]" "${common[@]}") &
}
servers=controller_server,smoother_server,planner_server,behavior_server,bt_navigator,waypoint_follower
remap=()
if [ -n "${SMOOTHED:-}" ]; then
  remap=(-r cmd_vel:=cmd_vel_nav)
  servers+=,velocity_smoother,collision_monitor
  start nav2_velocity_smoother/velocity_smoother "${remap[@]}"
  start nav2_collision_monitor/collision_monitor
fi
start nav2_controller/controller_server "${remap[@]}"
start nav2_behaviors/behavior_server "${remap[@]}"
for server in nav2_amcl/amcl nav2_planner/planner_server nav2_smoother/smoother_server nav2_bt_navigator/bt_navigator \
  nav2_waypoint_follower/waypoint_follower; do
  start "$server"
done
manager localization amcl
manager navigation "${MANAGED:-$servers}"
wait
