"""The demo for those who have ROS 2: the five nodes of cromosim as processes, recorded and drawn.

ros2 launch demo.launch.py [motion:=FILE.bvh] [out:=DIR]
Where colcon has built the package: ros2 launch cromosim demo.launch.py. Else the program `cromosim` has to be on PATH (cargo install --path .).
"""

import os
import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, TimerAction
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
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


def node(name, on_exit=died, **parameters):
    """One node of the suite, in the launch's namespace."""
    return Node(**where(name), name=name, namespace=LaunchConfiguration("namespace"), parameters=[parameters], output="screen", on_exit=on_exit)


def text(value):
    """A value of the launch as a text, whatever YAML would take it for."""
    return ParameterValue(value, value_type=str)


def played(event, context):
    """The end of the replay: the others have a moment for what is under way."""
    if event.returncode != 0:
        return died(event, context)
    return TimerAction(period=1.5, actions=[EmitEvent(event=Shutdown(reason="the motion has ended"))])


def make_folder(context):
    os.makedirs(LaunchConfiguration("out").perform(context), exist_ok=True)


def generate_launch_description():
    out = LaunchConfiguration("out")
    return LaunchDescription([
        DeclareLaunchArgument("namespace", default_value="", description="Of all nodes and their topics, such as robot1"),
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("out", default_value="cromosim-demo", description="Where bag and recording go; OUT/bag must not exist yet"),
        OpaqueFunction(function=make_folder),
        node("recorder", bag_path=text(PathJoinSubstitution([out, "bag"]))),
        node("viewer", recording=text(PathJoinSubstitution([out, "demo.rrd"]))),
        node("virtual_imu", ready_subscriptions=2),
        node("smpl_state", ready_subscriptions=3),
        node("replay", motion=text(LaunchConfiguration("motion")), ready_subscriptions=2, on_exit=played),
    ])
