"""The demo for those who have ROS 2: the five nodes of cromosim as processes, recorded and drawn.

ros2 launch demo.launch.py [motion:=FILE.bvh] [out:=DIR]
The program `cromosim` has to be on PATH (cargo install --path .).
"""

import os

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction, TimerAction
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution


def died(event, context):
    """Ends the launch, with an error, where a node ends that was not told to."""
    if event.returncode == 0 and context.is_shutdown:
        return None
    # launch's own Shutdown would end it with exit code 0.
    raise RuntimeError(f"{event.process_name} has ended with exit code {event.returncode}, and the launch with it")


def node(name, *parameters, on_exit=died):
    """One node of the suite; parameters are lists that make `name:=value`."""
    command = ["cromosim", "node", name, "--ros-args"]
    for parameter in parameters:
        command += ["-p", parameter]
    return ExecuteProcess(cmd=command, name=name, output="screen", on_exit=on_exit)


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
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("out", default_value="cromosim-demo", description="Where bag and recording go; OUT/bag must not exist yet"),
        OpaqueFunction(function=make_folder),
        node("recorder", ["bag_path:='", PathJoinSubstitution([out, "bag"]), "'"]),
        node("viewer", ["recording:='", PathJoinSubstitution([out, "demo.rrd"]), "'"]),
        node("virtual_imu", "ready_subscriptions:=2"),
        node("smpl_state", "ready_subscriptions:=3"),
        node("replay", ["motion:='", LaunchConfiguration("motion"), "'"], "ready_subscriptions:=2", on_exit=played),
    ])
