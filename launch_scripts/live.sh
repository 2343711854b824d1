#!/usr/bin/env bash
# The live case: the nodes run until Ctrl-C, a Rerun viewer shows what they publish, and nothing is recorded unless asked for.
#   live.sh [MOTION.bvh]            play a file (or the embedded walk) in a loop
#   BAG=out live.sh [MOTION.bvh]    record as well
# Start a viewer first: rerun --bind 127.0.0.1
set -euo pipefail
cromosim=${CROMOSIM:-cromosim}
here=$(cd "$(dirname "$0")/.." && pwd)
config=$here/config

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
start viewer --ros-args --params-file "$config/viewer.yaml"
[ -n "${BAG:-}" ] && start recorder --ros-args --params-file "$config/recorder.yaml" -p "bag_path:=$BAG"
start virtual_imu --ros-args --params-file "$config/virtual_imu.yaml"
start smpl_state --ros-args --params-file "$config/smpl_state.yaml"
start replay --ros-args --params-file "$config/replay.yaml" -p loop:=true -p "motion:='${1:-}'"
# Whichever node ends first ends all, with its exit code.
status=0
wait -n || status=$?
exit "$status"
