#!/bin/sh
# Fuzzes every reader for SECONDS (default 60) each, or TARGETs only: tests/fuzz/run.sh [SECONDS] [TARGET...]
# A crash, more than 2048 MB or an input that takes over 10 s ends it with an error; the input lies in tests/fuzz/artifacts.
set -eu
cd "$(dirname "$0")/../.."
seconds=${1:-60}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- $(sed -n 's/^name = "\(.*\)"$/\1/p' tests/fuzz/Cargo.toml | tail -n +2)
# libFuzzer's flags are for nightly compilers; this lets the stable one take them.
export RUSTC_BOOTSTRAP=1
for target in "$@"; do
    corpus=tests/fuzz/corpus/$target
    seeds=tests/fuzz/seeds/$target
    mkdir -p "$corpus" "$seeds"
    # What readers are tested on is where fuzzing starts.
    case $target in
        npz) find nodes -path '*/tests/data/*.npz' -size -100k -exec cp {} "$seeds" \; ;;
        pickle) cp nodes/lib/arrays/tests/data/* "$seeds" ;;
        datasets) cp tests/fuzz/samples/datasets/* nodes/lib/arrays/tests/data/*.mat nodes/lib/recording/tests/data/broad.mat "$seeds" ;;
        model) cp nodes/lib/body/tests/data/model_* "$seeds" ;;
        poses) find nodes/lib/motion/tests/data/poses nodes/lib/arrays/tests/data -type f -exec cp {} "$seeds" \; ;;
        bag) cp tests/fuzz/samples/bag/* nodes/lib/bag/tests/data/*.bag nodes/lib/bag/tests/data/sqlite/*.db3 "$seeds" ;;
        bvh | c3d) cp nodes/lib/motion/tests/data/*."$target" "$seeds" ;;
        *) cp tests/fuzz/samples/"$target"/* "$seeds" ;;
    esac
    echo "== $target: $seconds s"
    cargo fuzz run --fuzz-dir tests/fuzz --sanitizer none "$target" "$corpus" "$seeds" -- \
        -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 -max_len=1000000 -verbosity=1 -print_final_stats=1
done
