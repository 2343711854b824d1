#!/usr/bin/env bash
# What a refactoring must not change: makes one output of each offline command and prints its
# SHA-256, so that two builds can be compared by `diff <(tests/golden.sh A) <(tests/golden.sh B)`.
# usage: tests/golden.sh CROMOSIM [OUT]     data and cases: CROMOSIM_DATA, else ../shared/data; its sibling `cases`
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cromosim=$(realpath "${1:?usage: tests/golden.sh CROMOSIM [OUT]}")
out=${2:-$(mktemp -d)}
data=$(realpath -m "${CROMOSIM_DATA:-$root/../shared/data}")
cases=$(dirname "$data")/cases
poses=$root/nodes/lib/motion/tests/data
mkdir -p "$out" && cd "$out"
rm -rf ./*

# Runs and keeps the log; a failure is part of the output.
run() { "$cromosim" "$@" > log.txt 2>&1 || { echo "exit $?: $*"; tail -n 2 log.txt; }; }

cat > placements.yaml <<'YAML'
schema: cromosim/placements/1
defaults: {rate_hz: 100, device: worn.yaml}
placements:
  left_wrist: {site: left_watch}
  right_ankle: {site: right_instep, follow: segment}
  head: {site: forehead, rate_hz: 50, scheme: richardson}
YAML
cat > worn.yaml <<'YAML'
schema: cromosim/device/1
declared_noise: {accel_density: 0.002, gyro_density: 0.0002}
effects:
  - {effect: lever_arm, offset: [0.01, 0.0, 0.02]}
  - {effect: soft_tissue, natural_hz: 9.0, damping_ratio: 0.3}
  - {effect: low_pass, cutoff_hz: 20.0}
  - {effect: accel_bias, bias: [0.1, 0.0, -0.05]}
  - {effect: gyro_scale, scale: [1.01, 1.0, 0.99]}
  - {effect: time_offset, seconds: 0.02}
  - {effect: dropped_samples, fraction: 0.05, mean_burst: 2.0}
YAML
cat > effects.yaml <<'YAML'
schema: cromosim/effects/1
placements:
  left_wrist:
    epoch: 1.0
    declared_noise: {accel_density: 0.0014, gyro_density: 0.00012}
    effects:
      - {effect: mount_rotation, rotvec: [0.1, -0.05, 0.02]}
      - {effect: mount_slip, at: 5.0, rotvec: [0.0, 0.1, 0.0]}
      - {effect: soft_tissue, natural_hz: 7.0, damping_ratio: 0.4}
      - {effect: vibration, hz: 31.0, amplitude: [0.2, 0.1, 0.0], phase: [0.3, 0.3, 0.0], gyro_amplitude: [0.0, 0.02, 0.0], gyro_phase: [0.0, 1.0, 0.0]}
      - {effect: clock_drift, ppm: 80.0}
      - {effect: accel_noise, density: 0.003}
      - {effect: accel_quantization, lsb: 0.01}
YAML

run simulate --walk --out walk.mcap --csv csv
run simulate --walk --no-noise --scheme richardson --out walk_ideal.mcap
run simulate --walk --placements placements.yaml --seed 7 --out walk_worn.mcap
run convert walk.mcap walk.bvh
run simulate walk.bvh --out bvh.mcap
run simulate "$poses/poses/amass.npz" --out amass.mcap
run simulate "$poses/poses/chain_wham.pkl" --person all --out people.mcap
run simulate --reference walk.mcap --effects effects.yaml --out again.mcap
run simulate --reference walk.mcap --scheme spline --rate 60 --no-noise --out again_spline.mcap
run convert "walk.bvh" watch.tum --site left_watch
run simulate --rigid watch.tum --rate 100 --device consumer_mems --out rigid.mcap
run simulate --rigid watch.tum --rate 100 --learned motion_capture --out rigid_learned.mcap
run simulate --walk --learned motion_capture_60 --out walk_learned.mcap
run map --simulated walk.mcap --measured walk_worn.mcap --out map.yaml
run simulate --walk --mapping map.yaml --learned streaming --out walk_mapped.mcap
run convert bvh.mcap bvh.npz
run convert "walk.bvh" markers.trc
run convert again.mcap again.csv --topic /imu/left_wrist/data_raw
run compare walk.mcap walk_worn.mcap
cp log.txt compare.txt
run inspect walk.mcap
cp log.txt inspect.txt

cat > training.yaml <<'YAML'
schema: cromosim/training/1
input: residual
network: {channels: 8, kernel: 3, convolutions: 3, hidden: 8, layers: 2}
turns: heading
validation: [b]
training: {steps: 60, windows: 8, learning_rate: 0.01, validate_every: 20, patience: 5, seed: 3}
data:
  - {subject: a, licence: own, motions: ["*.bvh"], sites: [left_watch, right_instep], repeats: 2}
  - {subject: b, licence: own, motions: [walk.bvh], sites: [left_watch]}
YAML
run train training.yaml --data . --out model

if [ -d "$cases" ]; then
    for case in lever-arm none time-offset-and-bias vibration soft-tissue reference-units channel-delay reference-interpolation; do
        run diagnose "$cases/$case/fit.mcap" --out "diagnosis-$case"
        run simulate --reference "$cases/$case/check.mcap" --effects "diagnosis-$case/effects.yaml" --out "$case.mcap"
    done
fi
if [ -d "$data" ]; then
    run simulate "$data/mocap_cmu/13_07.bvh" --out cmu.mcap
    run convert "$data/paired_broad/21_undisturbed_fast_combined.npz" broad.mcap
    run evaluate fidelity --data "$data" --quick --out fidelity
    run evaluate har --data "$data" --quick --out har
fi
rm -f log.txt
# Not the Rerun recording, whose row ids are random, nor how long something took.
find . -type f ! -name '*.rrd' ! -name 'elapsed.json' | LC_ALL=C sort | xargs sha256sum
