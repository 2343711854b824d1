#!/usr/bin/env bash
# Watches the gap between real and virtual IMUs: the drivers of the real ones publish /imu/NAME/data_raw, a source of motion publishes
# /smpl/pose, and this starts what is between them. /diagnostics then says how far they lie apart, and the first cause. Runs until Ctrl-C.
#   gap.sh NAME...                                  placements of the demo: left_wrist, right_ankle, pelvis, sternum, head
#   PLACEMENTS=FILE.yaml gap.sh NAME...             placements of your own
#   MOTION=FILE.bvh gap.sh NAME...                  play a motion file in a loop rather than wait for /smpl/pose
set -euo pipefail
cromosim=${CROMOSIM:-cromosim}
here=$(cd "$(dirname "$0")/.." && pwd)
config=$here/config
[ $# -gt 0 ] || { echo "usage: gap.sh NAME..." >&2; exit 2; }

pids=()
# TERM: bash starts background processes with INT ignored.
stop() {
    trap - EXIT INT TERM
    kill -TERM "${pids[@]}" 2>/dev/null || true
    for _ in $(seq 50); do
        kill -0 "${pids[@]}" 2>/dev/null || break
        sleep 0.1
    done
    kill -KILL "${pids[@]}" 2>/dev/null || true
    wait || true
}
trap stop EXIT
trap 'exit 130' INT TERM

start() { "$cromosim" node "$@" & pids+=($!); }
remaps=()
for name in "$@"; do
    remaps+=(-r "imu/$name/data_raw:=/virtual/$name/data_raw" -r "imu/$name/data:=/virtual/$name/data")
done
names=$(IFS=,; echo "$*")
start gap_monitor --ros-args --params-file "$config/gap_monitor.yaml" -p "placements:=[$names]"
start virtual_imu --ros-args --params-file "$config/virtual_imu.yaml" -p "placements:='${PLACEMENTS:-}'" "${remaps[@]}"
start smpl_state --ros-args --params-file "$config/smpl_state.yaml"
[ -n "${MOTION:-}" ] && start replay --ros-args --params-file "$config/replay.yaml" -p loop:=true -p "motion:='$MOTION'"
# Whichever node ends first ends all, with its exit code.
status=0
wait -n || status=$?
exit "$status"
