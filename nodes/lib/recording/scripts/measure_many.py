#!/usr/bin/env python3
"""How long a data set of AMASS' size takes as columns, on this machine.

    python3 nodes/lib/recording/scripts/measure_many.py BINARY MOTIONS OUT [MINUTES [FORMAT]]

Converts the BVH files of the folder MOTIONS to npz with AMASS' keys, links these under new names until they
are MINUTES (2420) long, simulates 17 placements at 60 Hz of them into OUT, and prints minutes, bytes and peak memory. OUT
should have room for 6 GB of columns, or 80 GB of bags.
"""

import ast
import os
import re
import resource
import struct
import subprocess
import sys
import time
import zipfile
from pathlib import Path

PLACEMENTS = Path(__file__).resolve().parents[4] / "config/placements/full17.yaml"


def array(archive: zipfile.ZipFile, key: str) -> tuple[tuple[int, ...], str, bytes]:
    """Shape, type and bytes of an array."""
    content = archive.read(f"{key}.npy")
    at = 10 if content[6] == 1 else 12
    length = struct.unpack_from("<H" if at == 10 else "<I", content, 8)[0]
    header = ast.literal_eval(content[at : at + length].decode("latin-1"))
    return header["shape"], header["descr"], content[at + length :]


def seconds(path: Path) -> float:
    with zipfile.ZipFile(path) as archive:
        (frames, *_), _, _ = array(archive, "poses")
        _, kind, value = array(archive, "mocap_framerate")
        code = {"f": {4: "f", 8: "d"}, "i": {4: "i", 8: "q"}, "u": {4: "I", 8: "Q"}}
        kind, size = re.match(r"[<|=]([fiu])(\d)", kind).groups()
        rate = struct.unpack_from("<" + code[kind][int(size)], value)[0]
    return frames / rate


def main() -> None:
    binary, motions, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2]), Path(sys.argv[3])
    wanted = 60 * float(sys.argv[4] if len(sys.argv) > 4 else 2420)
    form = sys.argv[5] if len(sys.argv) > 5 else "parquet"
    (out / "npz").mkdir(parents=True)
    files = []
    for path in sorted(motions.glob("*.bvh")):
        npz = (out / "npz" / f"{path.stem}.npz").resolve()
        subprocess.run([binary, "convert", path, npz], check=True, stdout=subprocess.DEVNULL)
        files.append((npz, seconds(npz)))
    links, total, count = out / "motions", 0.0, 0
    while total < wanted:
        folder = links / f"{count // len(files):04}"
        folder.mkdir(parents=True, exist_ok=True)
        path, length = files[count % len(files)]
        (folder / path.name).symlink_to(path)
        total, count = total + length, count + 1
    command = [binary, "simulate", links, "--out", out / "imus", "--format", form]
    command += ["--placements", PLACEMENTS, "--rate", "60", "--device", "consumer_mems"]
    begun = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    gone = time.monotonic() - begun
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    size = sum(path.stat().st_size for path in (out / "imus").rglob(f"*.{'mcap' if form == 'bag' else form}"))
    print(
        f"{total / 60:.0f} minutes of motion in {count} files, {os.cpu_count()} cores: "
        f"{gone / 60:.2f} min, {used.ru_utime + used.ru_stime:.0f} s of processor time, "
        f"{size / 1e9:.2f} GB, at most {used.ru_maxrss / 1024:.0f} MB of memory"
    )


if __name__ == "__main__":
    main()
