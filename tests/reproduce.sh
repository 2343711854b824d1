#!/usr/bin/env bash
# Makes the tables of the crates' READMEs anew: `tests/reproduce.sh OUT [PART...]`, parts below; all of them where none is named.
# Needs the third-party data (CROMOSIM_DATA, else ../shared/data beside the checkout); `diagnosis` needs the Python packages of tests/withheld
# (CROMOSIM_PYTHON, else python3), `speed` an otherwise quiet machine.
set -euo pipefail
cd "$(dirname "$0")/.."

out=${1:?usage: tests/reproduce.sh OUT [models|fidelity|har|derivatives|diagnosis|speed]...}
shift
[ $# -gt 0 ] || set -- models fidelity har derivatives diagnosis speed
mkdir -p "$out"
out=$(cd "$out" && pwd)
data=${CROMOSIM_DATA:-../shared/data}
[ -d "$data" ] || { echo "error: no data at $data; name their folder in CROMOSIM_DATA" >&2; exit 2; }
python=${CROMOSIM_PYTHON:-python3}

# Without Rerun: no table needs it.
cargo build --release -p cromosim --no-default-features
cromosim=${CARGO_TARGET_DIR:-target}/release/cromosim
for part in "$@"; do
    printf '\n== %s (%s)\n' "$part" "$(date +%T)"
    case $part in
    # The weights in nodes/lib/learned/models.
    models)
        for model in motion_capture motion_capture_60 video streaming streaming_video; do
            "$cromosim" train "config/training/$model.yaml" --data "$data" --out "$out/models/$model"
            for network in acceleration angular_velocity; do
                if cmp -s "$out/models/$model/$network.safetensors" "nodes/lib/learned/models/$model/$network.safetensors"; then
                    echo "$model, $network: the same bytes as the suite's"
                else
                    echo "$model, $network: OTHER bytes than the suite's"
                fi
            done
        done
        ;;
    fidelity) "$cromosim" evaluate fidelity --data "$data" --out "$out/fidelity" --force ;;
    har) "$cromosim" evaluate har --data "$data" --learned motion_capture --out "$out/har" --force ;;
    derivatives) cargo test -p cromosim_imu -p cromosim_motion -- --nocapture ;;
    diagnosis)
        "$python" tests/withheld/run.py --seed 11 --cromosim "$cromosim" --out "$out/withheld"
        "$python" tests/withheld/real.py --cromosim "$cromosim" --out "$out/real"
        ;;
    speed) cargo bench -p cromosim_body -p cromosim_imu -p cromosim_virtual_imu -p cromosim_learned ;;
    *) echo "error: no part $part" >&2; exit 2 ;;
    esac
done
