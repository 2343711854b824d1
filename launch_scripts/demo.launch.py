"""The demo for those who have ROS 2: the five nodes of cromosim as processes, recorded and drawn.

ros2 launch demo.launch.py [motion:=FILE.bvh] [out:=DIR]
The program `cromosim` has to be on PATH (cargo install --path .).
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, RegisterEventHandler, TimerAction
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution


def node(name, *parameters):
    """One node of the suite; parameters are lists that make `name:=value`."""
    command = ["cromosim", "node", name, "--ros-args"]
    for parameter in parameters:
        command += ["-p", parameter]
    return ExecuteProcess(cmd=command, name=name, output="screen")


def generate_launch_description():
    out = LaunchConfiguration("out")
    replay = node("replay", ["motion:='", LaunchConfiguration("motion"), "'"], "ready_subscriptions:=2")
    finish = TimerAction(period=1.5, actions=[EmitEvent(event=Shutdown(reason="the motion has ended"))])
    return LaunchDescription([
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("out", default_value="cromosim-demo", description="Where bag and recording go; OUT/bag must not exist yet"),
        node("recorder", ["bag_path:=", PathJoinSubstitution([out, "bag"])]),
        node("viewer", ["recording:=", PathJoinSubstitution([out, "demo.rrd"])]),
        node("virtual_imu", "ready_subscriptions:=2"),
        node("smpl_state", "ready_subscriptions:=3"),
        replay,
        RegisterEventHandler(OnProcessExit(target_action=replay, on_exit=[finish])),
    ])
