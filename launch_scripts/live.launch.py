"""The live case for those who have ROS 2: loop a motion, publish virtual IMUs, show them in a running Rerun viewer.

ros2 launch live.launch.py [motion:=FILE.bvh] [placements:=FILE.yaml]
Where colcon has built the package: ros2 launch cromosim live.launch.py. Else the program `cromosim` has to be on PATH (cargo install --path .); start `rerun --bind 127.0.0.1` first.
"""

import os
import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def where(name):
    """A node of the package that this file was installed with, else of the program `cromosim` on PATH."""
    prefix = pathlib.Path(os.path.abspath(__file__)).parents[3:4]
    if any((folder / "lib/cromosim" / name).is_file() for folder in prefix):
        return {"package": "cromosim", "executable": name}
    return {"executable": "cromosim", "arguments": ["node", name], "exec_name": name}


def died(event, context):
    """Ends the launch, with an error, where a node ends that was not told to."""
    # -2: told to end before it listened to signals.
    if event.returncode in (0, -2) and context.is_shutdown:
        return None
    # launch's own Shutdown would end it with exit code 0.
    raise RuntimeError(f"{event.process_name} has ended with exit code {event.returncode}, and the launch with it")


def node(name, **parameters):
    """One node of the suite, in the launch's namespace."""
    return Node(
        **where(name), name=name, namespace=LaunchConfiguration("namespace"), parameters=[parameters] if parameters else None, output="screen", on_exit=died
    )


def text(argument):
    """A launch argument as a text, whatever YAML would take it for."""
    return ParameterValue(LaunchConfiguration(argument), value_type=str)


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("namespace", default_value="", description="Of all nodes and their topics, such as robot1"),
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("placements", default_value="", description="Sensor placements (YAML); empty: the demo's"),
        node("viewer"),
        node("virtual_imu", placements=text("placements")),
        node("smpl_state"),
        node("replay", motion=text("motion"), loop=True),
    ])
