#!/usr/bin/env bash
# Start the servers of Nav2 as separate processes: bringup.sh ENV PARAMS (both as `rig.py` describes them in rig.json)
source "$1"
params=$2
for server in nav2_amcl/amcl nav2_planner/planner_server nav2_controller/controller_server \
  nav2_behaviors/behavior_server nav2_smoother/smoother_server nav2_bt_navigator/bt_navigator; do
  (node "${server%/*}" "${server#*/}" --ros-args --params-file "$params") &
done
manager() { # NAME NODES
  (node nav2_lifecycle_manager lifecycle_manager --ros-args -r __node:="lifecycle_manager_$1" -p use_sim_time:=true \
    -p autostart:=true -p bond_timeout:=0.0 -p node_names:="$2") &
}
manager localization '[amcl]'
manager navigation '[controller_server,smoother_server,planner_server,behavior_server,bt_navigator]'
wait
