# Sourced by the scripts that run several nodes: `start NODE ARGUMENTS...`, then `until_one_ends`. When the script ends, for whatever reason, the nodes end.
cromosim=${CROMOSIM:-cromosim}
config=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/config

pids=()
# TERM, because bash starts background processes with INT ignored.
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

# The first node that ends, ends them all; its exit code is the script's.
until_one_ends() {
    local status=0
    wait -n || status=$?
    exit "$status"
}
