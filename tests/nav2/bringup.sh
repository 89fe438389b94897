#!/usr/bin/env bash
# Start the servers of Nav2 as separate processes: bringup.sh ENV PARAMS [ARGUMENT OF ROS...]
#
# ENV and PARAMS as `rig.py` describes them in rig.json. MANAGED = the navigation servers that become active.
source "$1"
params=$2
shift 2
for server in nav2_amcl/amcl nav2_planner/planner_server nav2_controller/controller_server \
  nav2_behaviors/behavior_server nav2_smoother/smoother_server nav2_bt_navigator/bt_navigator; do
  (node "${server%/*}" "${server#*/}" --ros-args --params-file "$params" "$@") &
done
manager() { # NAME NODES
  local name=$1 nodes=$2; shift 2
  (node nav2_lifecycle_manager lifecycle_manager --ros-args -r __node:="lifecycle_manager_$name" -p use_sim_time:=true \
    -p autostart:=true -p bond_timeout:=0.0 -p node_names:="[$nodes]" "$@") &
}
manager localization amcl "$@"
manager navigation "${MANAGED:-controller_server,smoother_server,planner_server,behavior_server,bt_navigator}" "$@"
wait
