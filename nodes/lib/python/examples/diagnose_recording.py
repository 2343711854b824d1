"""Why a real IMU and its simulation differ, and what the simulation is worth once that is known.

    python diagnose_recording.py bags/gap/session diagnosis
"""

import sys

import cromosim


def main(recording: str, out: str) -> None:
    found = cromosim.diagnose(cromosim.read_recording(recording), title=recording)
    for name, placement in found.placements.items():
        (before, _), (after, _) = placement.rmse_before, placement.rmse_after
        print(f"{name}: {placement.verdict}")
        print(f"  specific force: {before:.3f} m/s2 before, {after:.3f} m/s2 with the causes")
        for cause in placement.causes:
            print(f"  {cause.effect}: {100 * cause.gap_share:.0f} % of the gap, {cause.parameters}")
    found.write(out)
    print(f"{out}: report.html, diagnosis.json, effects.yaml")


if __name__ == "__main__":
    main(*sys.argv[1:])
