#!/usr/bin/env bash
# Simulates a data set on a Slurm cluster, each task of the array a part of it, into one folder:
#
#   sbatch --array=1-16 nodes/lib/python/examples/slurm_simulate.sh data/amass imus --placements sensors.yaml
#
# The same line again does what is missing: tasks that were killed, motions that failed or changed.
# Another number of tasks goes on with what the others did.
#SBATCH --job-name=cromosim
#SBATCH --cpus-per-task=4
set -euo pipefail
inputs=$1
out=$2
shift 2
export RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-}
[ -n "$RAYON_NUM_THREADS" ] || unset RAYON_NUM_THREADS
exec "${CROMOSIM_BINARY:-cromosim}" simulate "$inputs" --out "$out" --format parquet \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" "$@"
