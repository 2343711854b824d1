#!/usr/bin/env bash
# Several people of one motion file, each in a namespace of its own with frames of its own prefix; runs until the motion ends.
#   people.sh FILE NAME...          names as shown by `cromosim inspect FILE`, of letters and digits: people.sh wham.pkl 0 3
#   BAG=out people.sh FILE NAME...  record as well
# /person_NAME/smpl/pose, /person_NAME/smpl/state, /person_NAME/imu/PLACEMENT/data_raw; frames person_NAME/pelvis and so on.
set -euo pipefail
[ $# -gt 1 ] || { echo "usage: people.sh FILE NAME..." >&2; exit 2; }
source "$(dirname "$0")/nodes.sh"

motion=$1
shift
names=$(IFS=,; echo "$*")
listeners=1
[ -n "${BAG:-}" ] && listeners=2 && start recorder --ros-args --params-file "$config/recorder.yaml" -p "bag_path:=$BAG"
for name in "$@"; do
    own=(-r "__ns:=/person_$name" -p "prefix:=person_$name")
    start virtual_imu --ros-args --params-file "$config/virtual_imu.yaml" "${own[@]}"
    start smpl_state --ros-args --params-file "$config/smpl_state.yaml" "${own[@]}"
done
# The comma at the end makes a list even of one person, who then gets a namespace too.
start replay --ros-args --params-file "$config/replay.yaml" -p "motion:='$motion'" -p "person:='$names,'" -p "ready_subscriptions:=$listeners"
status=0
wait "${pids[-1]}" || status=$?
# Messages that are still on their way arrive.
sleep 1.5
exit "$status"
