"""The live case for those who have ROS 2: loop a motion, publish virtual IMUs, show them in a running Rerun viewer.

ros2 launch live.launch.py [motion:=FILE.bvh] [placements:=FILE.yaml]
Where colcon has built the package: ros2 launch cromosim live.launch.py. Else the program `cromosim` has to be on PATH (cargo install --path .); start `rerun --bind 127.0.0.1` first.
"""

import os
import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def program():
    """`cromosim` of the package that this file was installed with, else the one on PATH."""
    prefix = pathlib.Path(os.path.abspath(__file__)).parents[3:4]
    installed = [folder / "lib/cromosim/cromosim" for folder in prefix]
    return next((str(path) for path in installed if path.is_file()), "cromosim")


def died(event, context):
    """Ends the launch, with an error, where a node ends that was not told to."""
    if event.returncode == 0 and context.is_shutdown:
        return None
    # launch's own Shutdown would end it with exit code 0.
    raise RuntimeError(f"{event.process_name} has ended with exit code {event.returncode}, and the launch with it")


def node(name, *parameters):
    """One node of the suite; parameters are lists that make `name:=value`."""
    command = [program(), "node", name, "--ros-args", "-r", ["__ns:=/", LaunchConfiguration("namespace")]]
    for parameter in parameters:
        command += ["-p", parameter]
    return ExecuteProcess(cmd=command, name=name, output="screen", on_exit=died)


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("namespace", default_value="", description="Of all nodes and their topics, such as robot1"),
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("placements", default_value="", description="Sensor placements (YAML); empty: the demo's"),
        node("viewer"),
        node("virtual_imu", ["placements:='", LaunchConfiguration("placements"), "'"]),
        node("smpl_state"),
        node("replay", ["motion:='", LaunchConfiguration("motion"), "'"], "loop:=true"),
    ])
