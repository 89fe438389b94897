"""Load the servers of Nav2 into a running `component_container_isolated`, as a composed bringup does.

    python compose.py CONTAINER PARAMS

Each server gets its parameters of the file PARAMS, because a container passes its own only to nodes that a server
creates, such as costmaps.
"""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import rclpy
import yaml
from composition_interfaces.srv import LoadNode
from rcl_interfaces.msg import Parameter, ParameterValue
from rclpy.parameter import Parameter as Value

SERVERS = {
    "amcl": ("nav2_amcl", "nav2_amcl::AmclNode"),
    "planner_server": ("nav2_planner", "nav2_planner::PlannerServer"),
    "controller_server": ("nav2_controller", "nav2_controller::ControllerServer"),
    "behavior_server": ("nav2_behaviors", "behavior_server::BehaviorServer"),
    "smoother_server": ("nav2_smoother", "nav2_smoother::SmootherServer"),
    "bt_navigator": ("nav2_bt_navigator", "nav2_bt_navigator::BtNavigator"),
}
MANAGER = ("nav2_lifecycle_manager", "nav2_lifecycle_manager::LifecycleManager")


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("compose")
    client = node.create_client(LoadNode, f"/{sys.argv[1]}/_container/load_node")
    client.wait_for_service(60.0)

    def load(name: str, package: str, plugin: str, **parameters: object) -> None:
        listed = [parameter(key, value) for key, value in {"use_sim_time": True, **parameters}.items()]
        request = LoadNode.Request(package_name=package, plugin_name=plugin, node_name=name, parameters=listed)
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future)
        if not future.result().success:
            sys.exit(f"compose: {name}: {future.result().error_message}")

    nodes = yaml.safe_load(Path(sys.argv[2]).read_text())
    for name, component in SERVERS.items():
        load(name, *component, **dict(flattened(nodes[name]["ros__parameters"])))
    load("lifecycle_manager", *MANAGER, autostart=True, bond_timeout=0.0, node_names=[*SERVERS])
    rclpy.shutdown()


def flattened(parameters: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the parameters with dotted names."""
    for key, value in parameters.items():
        if isinstance(value, Mapping):
            yield from flattened(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def parameter(name: str, value: object) -> Parameter:
    found: ParameterValue = Value(name, value=value).get_parameter_value()
    return Parameter(name=name, value=found)


if __name__ == "__main__":
    main()
