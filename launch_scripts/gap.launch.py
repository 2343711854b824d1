"""Watch the gap between real and virtual IMUs, for those who have ROS 2.

ros2 launch gap.launch.py names:=left_wrist,head [placements:=FILE.yaml] [motion:=FILE.bvh]
The drivers of the real IMUs publish /imu/NAME/data_raw, a source of motion publishes /smpl/pose (or motion:=FILE.bvh is looped); /diagnostics
says how far apart real and virtual ones are, and the first cause.
Where colcon has built the package: ros2 launch cromosim gap.launch.py. Else the program `cromosim` has to be on PATH (cargo install --path .).
"""

import os
import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


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


def node(name, remappings=None, **parameters):
    """One node of the suite, in the launch's namespace."""
    return Node(
        **where(name), name=name, namespace=LaunchConfiguration("namespace"), parameters=[parameters] if parameters else None, remappings=remappings, output="screen", on_exit=died
    )


def nodes(context):
    names = [name for name in LaunchConfiguration("names").perform(context).split(",") if name]
    placements = LaunchConfiguration("placements").perform(context)
    motion = LaunchConfiguration("motion").perform(context)
    remaps = []
    for name in names:
        for ending in ["data_raw", "data"]:
            remaps.append((f"imu/{name}/{ending}", f"/virtual/{name}/{ending}"))
    started = [
        node("gap_monitor", placements=names),
        node("virtual_imu", remappings=remaps, placements=placements),
        node("smpl_state"),
    ]
    if motion:
        started.append(node("replay", motion=motion, loop=True))
    return started


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("namespace", default_value="", description="Of all nodes and their topics, such as robot1"),
        DeclareLaunchArgument("names", description="Placements to watch, separated by commas"),
        DeclareLaunchArgument("placements", default_value="", description="Sensor placements (YAML); empty: the demo's"),
        DeclareLaunchArgument("motion", default_value="", description="A BVH file to loop; empty: /smpl/pose comes from elsewhere"),
        OpaqueFunction(function=nodes),
    ])
