#!/usr/bin/env python3
"""Makes a picture of a Rerun recording without a screen.

Usage: screenshot.py RUN.rrd OUT.png [--time SECONDS] [--size 1600x1000]

Needs the PyPI package rerun-sdk 0.36.3 in the Python that runs this, and a Vulkan driver; without a graphics card Mesa's
software one (Debian: mesa-vulkan-drivers libvulkan1). The viewer listens on 127.0.0.1 alone, with analytics off in a
configuration folder of its own, and is ended by its process id. The time cursor is set through the viewer's own control
interface (`rerun viewer-mcp`, JSON-RPC lines on stdin and stdout).
"""

import argparse
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

WAIT_S = 120.0  # software rendering on a busy machine is slow
TITLE_BAR = 29  # pixels
PNG_END = b"IEND\xaeB`\x82"


class Control:
    """A JSON-RPC client of `rerun viewer-mcp`: one request at a time."""

    def __init__(self, rerun, env):
        self.process = subprocess.Popen(
            [rerun, "viewer-mcp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env
        )
        self.last_id = 0

    def connect(self, port):
        hello = {"protocolVersion": "2024-11-05", "capabilities": {}, "clientInfo": {"name": "screenshot", "version": "1"}}
        self.request("initialize", hello)
        self.send({"jsonrpc": "2.0", "method": "notifications/initialized"})
        self.call("connect", endpoint=f"http://127.0.0.1:{port}")

    def send(self, message):
        self.process.stdin.write(json.dumps(message) + "\n")
        self.process.stdin.flush()

    def request(self, method, params):
        self.last_id += 1
        self.send({"jsonrpc": "2.0", "id": self.last_id, "method": method, "params": params})
        for line in self.process.stdout:
            answer = json.loads(line) if line.startswith("{") else {}
            if answer.get("id") == self.last_id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
        raise RuntimeError(f"{method}: the control process ended")

    def call(self, tool, **arguments):
        result = self.request("tools/call", {"name": tool, "arguments": arguments})
        text = "".join(part.get("text", "") for part in result.get("content", []))
        if result.get("isError"):
            raise RuntimeError(f"{tool}: {text}")
        return text

    def state(self):
        return json.loads(self.call("viewer_state"))

    def close(self):
        end(self.process)


def end(process):
    """Ends a process we started, gently first."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for_port(port, viewer):
    deadline = time.monotonic() + WAIT_S
    while time.monotonic() < deadline:
        if viewer.poll() is not None:
            raise RuntimeError(f"the viewer ended with code {viewer.returncode}")
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise RuntimeError(f"the viewer does not listen after {WAIT_S} s")


def wait_for_recording(control):
    """Waits until a recording is open and its time ranges have stopped growing."""
    deadline, before = time.monotonic() + WAIT_S, None
    while time.monotonic() < deadline:
        now = [(r.get("recording_id"), ranges(r)) for r in control.state().get("recordings", [])]
        if now and now == before and any(found for _, found in now):
            return
        before = now
        time.sleep(1.0)
    raise RuntimeError(f"no recording is open after {WAIT_S} s")


def ranges(recording):
    return [(t.get("timeline"), t.get("min"), t.get("max")) for t in recording.get("timelines", [])]


def whole_picture(path):
    """The bytes of the PNG that the viewer writes: it answers before the file is complete, and may write it twice."""
    deadline = time.monotonic() + WAIT_S
    while time.monotonic() < deadline:
        if path.exists():
            data = path.read_bytes()
            if data.endswith(PNG_END):
                return data
        time.sleep(0.05)
    raise RuntimeError(f"no picture after {WAIT_S} s")


def cut_title_bar(path):
    from PIL import Image

    picture = Image.open(path).convert("RGB")
    picture.crop((0, TITLE_BAR, *picture.size)).save(path, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("picture", type=pathlib.Path)
    parser.add_argument("--time", type=float, default=None, help="seconds after the timeline's first moment (default: half way)")
    parser.add_argument("--timeline", default="time")
    parser.add_argument("--size", default="1600x1000")
    parser.add_argument("--no-title-bar", action="store_true", help="cut the viewer's own title bar off (needs Pillow, as rerun-sdk does)")
    parser.add_argument("--state", action="store_true", help="print the viewer's state")
    options = parser.parse_args()

    import rerun as package
    from rerun.experimental import ViewerClient

    # The `rerun` command of the package is a Python shim around this binary; ending the shim would leave the viewer running.
    rerun = str(pathlib.Path(package.__file__).parents[1] / "rerun_cli" / "rerun")
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        env = dict(os.environ, HOME=home, XDG_CONFIG_HOME=f"{home}/.config", XDG_DATA_HOME=f"{home}/.local/share")
        subprocess.run([rerun, "analytics", "disable"], env=env, check=True, capture_output=True)
        command = [rerun, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", options.size]
        viewer = subprocess.Popen([*command, str(options.recording.resolve())], env=env)
        control = None
        try:
            wait_for_port(port, viewer)
            control = Control(rerun, env)
            control.connect(port)
            wait_for_recording(control)
            state = control.state()
            if options.state:
                print(json.dumps(state, indent=1))
            found = [t for r in state["recordings"] for t in r["timelines"] if t.get("timeline") == options.timeline]
            if not found:
                raise RuntimeError(f"the recording has no timeline {options.timeline!r}: {state}")
            first, last = int(found[0]["min"]), int(found[0]["max"])
            cursor = (first + last) // 2 if options.time is None else first + round(options.time * 1e9)
            control.call("set_time", time=cursor, timeline=options.timeline)
            time.sleep(3.0)  # a few frames of software rendering
            shot = pathlib.Path(home, "shot.png")
            ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy").save_screenshot(str(shot))
            options.picture.write_bytes(whole_picture(shot))
            if options.no_title_bar:
                cut_title_bar(options.picture)
        finally:
            if control:
                control.close()
            end(viewer)
    print(f"{options.picture}: {options.recording} at {cursor * 1e-9:.3f} s of {first * 1e-9:.3f}..{last * 1e-9:.3f} s")


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError, subprocess.SubprocessError) as error:
        sys.exit(f"screenshot.py: {error}")
