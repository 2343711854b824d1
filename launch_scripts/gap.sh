#!/usr/bin/env bash
# Watches the gap between real and virtual IMUs: the drivers of the real ones publish /imu/NAME/data_raw, a source of motion publishes
# /smpl/pose, and this starts the nodes in between. /diagnostics then says how far apart they are, and the first cause. Runs until Ctrl-C.
#   gap.sh NAME...                                  placements of the demo: left_wrist, right_ankle, pelvis, sternum, head
#   PLACEMENTS=FILE.yaml gap.sh NAME...             placements of your own
#   MOTION=FILE.bvh gap.sh NAME...                  play a motion file in a loop instead of waiting for /smpl/pose
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: gap.sh NAME..." >&2; exit 2; }
source "$(dirname "$0")/nodes.sh"

remaps=()
for name in "$@"; do
    remaps+=(-r "imu/$name/data_raw:=/virtual/$name/data_raw" -r "imu/$name/data:=/virtual/$name/data")
done
names=$(IFS=,; echo "$*")
start gap_monitor --ros-args --params-file "$config/gap_monitor.yaml" -p "placements:=[$names]"
start virtual_imu --ros-args --params-file "$config/virtual_imu.yaml" -p "placements:='${PLACEMENTS:-}'" "${remaps[@]}"
start smpl_state --ros-args --params-file "$config/smpl_state.yaml"
[ -n "${MOTION:-}" ] && start replay --ros-args --params-file "$config/replay.yaml" -p loop:=true -p "motion:='$MOTION'"
until_one_ends
