"""The live case for those who have ROS 2: loop a motion, publish virtual IMUs, show them in a running Rerun viewer.

ros2 launch live.launch.py [motion:=FILE.bvh] [placements:=FILE.yaml]
The program `cromosim` has to be on PATH (cargo install --path .); start `rerun --bind 127.0.0.1` first.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def died(event, context):
    """Ends the launch, with an error, where a node ends that was not told to."""
    if event.returncode == 0 and context.is_shutdown:
        return None
    # launch's own Shutdown would end it with exit code 0.
    raise RuntimeError(f"{event.process_name} has ended with exit code {event.returncode}, and the launch with it")


def node(name, *parameters):
    """One node of the suite; parameters are lists that make `name:=value`."""
    command = ["cromosim", "node", name, "--ros-args"]
    for parameter in parameters:
        command += ["-p", parameter]
    return ExecuteProcess(cmd=command, name=name, output="screen", on_exit=died)


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("motion", default_value="", description="A BVH file; empty: the embedded walk"),
        DeclareLaunchArgument("placements", default_value="", description="Sensor placements (YAML); empty: the demo's"),
        node("viewer"),
        node("virtual_imu", ["placements:='", LaunchConfiguration("placements"), "'"]),
        node("smpl_state"),
        node("replay", ["motion:='", LaunchConfiguration("motion"), "'"], "loop:=true"),
    ])
