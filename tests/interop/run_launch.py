"""Runs a ROS 2 launch file as `ros2 launch` does: run_launch.py FILE [NAME:=VALUE]...; its exit code is launch's."""

import importlib.util
import sys

from launch import LaunchDescription, LaunchService
from launch.actions import SetLaunchConfiguration

spec = importlib.util.spec_from_file_location("description", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
given = [SetLaunchConfiguration(*argument.split(":=", 1)) for argument in sys.argv[2:]]
service = LaunchService()
service.include_launch_description(LaunchDescription(given + module.generate_launch_description().entities))
sys.exit(service.run())
