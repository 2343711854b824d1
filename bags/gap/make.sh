#!/usr/bin/env bash
# Makes the two recordings beside it anew (the same bytes each time on one machine): two sensors on
# the embedded walk, the wrist's with the errors in made_from/the_watch.yaml.
#   CROMOSIM=target/debug/cromosim bags/gap/make.sh      default: the cromosim on PATH
set -euo pipefail
cromosim=$(command -v "${CROMOSIM:-cromosim}")
cromosim=$(realpath "$cromosim")
cd "$(dirname "$0")"

# The walk's poses are exact: the scheme expects no noise of them.
# Walking: what is diagnosed.
"$cromosim" simulate --walk --placements made_from/placements.yaml --duration 6 --scheme spline --seed 1 --out session --force
# Stopping, reaching out and turning: what the diagnosis is checked on.
"$cromosim" simulate --walk --placements made_from/placements.yaml --start 6 --scheme spline --seed 2 --out check --force
