"""Real ROS 2 (rclpy) beside our nodes, started as `ros2 run` would start them; tests/interop/ros2.sh makes both.

Finds the nodes by the ament index, hears typed Imu and SmplState messages, sees the graph, asks for parameters and sets them, plays by replay's services.
Prints what it saw; exit code 1 where anything is missing. Needs rclpy and the packages that colcon built, and a network of its own.
"""

import pathlib
import signal
import subprocess
import time

import rclpy
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from builtin_interfaces.msg import Time
from cromosim_msgs.msg import SmplState
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rosbag2_interfaces.srv import GetRate, IsPaused, Pause, PlayNext, Resume, Seek, SetRate
from sensor_msgs.msg import Imu

PATIENCE_S = 60.0
# Nodes that start all at once beside a Fast DDS participant that was there before may miss each other's discovery.
HEAD_START_S = 3.0
NODES = {"replay": ["loop:=true"], "smpl_state": [], "virtual_imu": []}


def until(executor, what, done):
    """Spins until it is done; says which it waits for if it never is."""
    end = time.monotonic() + PATIENCE_S
    while not done():
        if time.monotonic() > end:
            raise SystemExit(f"error: {what} did not come within {PATIENCE_S:.0f} s")
        executor.spin_once(timeout_sec=0.1)


def call(executor, node, kind, name, request):
    client = node.create_client(kind, name)
    until(executor, f"the service {name}", client.service_is_ready)
    future = client.call_async(request)
    until(executor, f"the answer of {name}", future.done)
    return future.result()


def check(executor, node):
    states, samples = [], []
    node.create_subscription(SmplState, "/smpl/state", states.append, 10)
    node.create_subscription(Imu, "/imu/left_wrist/data_raw", samples.append, 10)
    until(executor, "20 messages of Imu and SmplState", lambda: min(len(states), len(samples)) >= 20)
    force = samples[-1].linear_acceleration
    norm = (force.x**2 + force.y**2 + force.z**2) ** 0.5
    assert 2.0 < norm < 60.0, f"specific force of {norm} m/s2"
    assert samples[-1].linear_acceleration_covariance[0] > 0.0
    pelvis = states[-1].world_from_pelvis.position
    assert states[-1].body_id and 0.5 < pelvis.z < 1.5, states[-1]
    print(f"heard {len(states)} SmplState, {len(samples)} Imu in frame {samples[-1].header.frame_id}")

    until(executor, "the nodes in the graph", lambda: set(NODES) <= set(node.get_node_names()))
    types = dict(node.get_topic_names_and_types())
    assert types["/smpl/state"] == ["cromosim_msgs/msg/SmplState"], types
    print("graph:", ", ".join(sorted(set(NODES) & set(node.get_node_names()))))

    names = call(executor, node, ListParameters, "/virtual_imu/list_parameters", ListParameters.Request())
    assert "seed" in names.result.names, names.result.names
    answer = call(executor, node, GetParameters, "/replay/get_parameters", GetParameters.Request(names=["loop"]))
    assert answer.values[0].bool_value, answer
    answer = change(executor, node, "virtual_imu", "placements", "elsewhere.yaml")
    assert not answer.successful and "read-only" in answer.reason, answer
    print(f"parameters: {len(names.result.names)}")
    print("refused:", answer.reason)
    assert change(executor, node, "virtual_imu", "noise", False).successful
    play(executor, node, states)


def change(executor, node, owner, name, value):
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return call(executor, node, SetParameters, f"/{owner}/set_parameters", request).results[0]


def play(executor, node, states):
    """What a player's panel asks of rosbag2, asked of replay."""
    def ask(kind, name, **fields):
        return call(executor, node, kind, f"/replay/{name}", kind.Request(**fields))

    ask(Pause, "pause")
    assert ask(IsPaused, "is_paused").paused
    states.clear()
    assert ask(PlayNext, "play_next").success
    until(executor, "the one state that was asked for", lambda: states)
    assert ask(SetRate, "set_rate", rate=2.0).success and ask(GetRate, "get_rate").rate == 2.0
    assert change(executor, node, "replay", "rate", 1.0).successful and ask(GetRate, "get_rate").rate == 1.0
    before = len(states)
    ask(Resume, "resume")
    until(executor, "states after the pause", lambda: len(states) >= before + 5)
    assert not ask(Seek, "seek", time=Time(sec=10_000)).success
    print("replay: paused, one state, resumed; rate by service and by parameter; a seek beyond its end refused")


def main():
    prefix = pathlib.Path(get_package_prefix("cromosim"))
    share = pathlib.Path(get_package_share_directory("cromosim"))
    for file in ["config/virtual_imu.yaml", "config/placements/full17.yaml", "launch/live.launch.py"]:
        assert (share / file).is_file(), share / file
    started = []
    try:
        for name, parameters in NODES.items():
            command = [prefix / "lib/cromosim" / name, "--ros-args"]
            for parameter in parameters:
                command += ["-p", parameter]
            started.append(subprocess.Popen(command))
        time.sleep(HEAD_START_S)
        rclpy.init()
        node = rclpy.create_node("listener")
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        check(executor, node)
    finally:
        for process in started:
            process.send_signal(signal.SIGINT)
        codes = [process.wait(timeout=30) for process in started]
        rclpy.try_shutdown()
    assert codes == [0] * len(codes), codes
    print("ended:", codes)


if __name__ == "__main__":
    main()
