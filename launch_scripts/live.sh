#!/usr/bin/env bash
# The live case: the nodes run until Ctrl-C, a Rerun viewer shows what they publish, and nothing is recorded unless you ask for it.
#   live.sh [MOTION.bvh]            play a file (or the embedded walk) in a loop
#   BAG=out live.sh [MOTION.bvh]    record as well
# Start a viewer first: rerun --bind 127.0.0.1
set -euo pipefail
source "$(dirname "$0")/nodes.sh"

start viewer --ros-args --params-file "$config/viewer.yaml"
[ -n "${BAG:-}" ] && start recorder --ros-args --params-file "$config/recorder.yaml" -p "bag_path:=$BAG"
start virtual_imu --ros-args --params-file "$config/virtual_imu.yaml"
start smpl_state --ros-args --params-file "$config/smpl_state.yaml"
start replay --ros-args --params-file "$config/replay.yaml" -p loop:=true -p "motion:='${1:-}'"
until_one_ends
