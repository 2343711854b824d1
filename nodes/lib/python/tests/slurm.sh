#!/usr/bin/env bash
# examples/slurm_simulate.sh under a real Slurm (Debian: slurmctld, slurmd, slurm-client, munge), in a network namespace of its own, as root.
#
# nodes/lib/python/tests/slurm.sh CROMOSIM MOTIONS FOLDER
# One task, then two at once, then four of which one is killed, and the array again: prints times and files, and fails where the
# outputs differ. MOTIONS is a folder; FOLDER gets all that is written.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

if [ "${1:-}" != inside ]; then
    CROMOSIM_BINARY=$(realpath "$1") motions=$(realpath "$2")
    mkdir -p "$3" && folder=$(realpath "$3")
    export CROMOSIM_BINARY
    # Names are not looked up where loopback is all there is: a pair of interfaces that lead nowhere.
    exec unshare -n -u sh -c 'hostname localhost; ip link set lo up; ip link add e0 type veth peer name e1; ip addr add 10.9.9.1/24 dev e0
        ip link set e0 up; ip link set e1 up; exec bash "$@"' sh "$here/slurm.sh" inside "$motions" "$folder"
fi

motions=$2 folder=$3
cd "$folder"
mkdir -p spool state log munge
cat > slurm.conf << END
ClusterName=here
SlurmctldHost=localhost(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/ctld.pid
SlurmdPidFile=$folder/d.pid
NodeName=localhost NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=localhost Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$folder/slurm.conf
dd if=/dev/urandom of=munge/key bs=1024 count=1 status=none
chmod 400 munge/key && chmod 711 munge && chown -R munge munge
runuser -u munge -- munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" \
    --log-file="$folder/munge/log" --pid-file="$folder/munge/pid" --seed-file="$folder/munge/seed" > log/munged 2>&1 &
started=$!
sleep 1
slurmctld -D > log/slurmctld 2>&1 &
started="$! $started"
slurmd -D > log/slurmd 2>&1 &
started="$! $started"
trap 'kill $started; wait 2> log/ends' EXIT
until sinfo --noheader 2> /dev/null | grep -q idle; do sleep 0.2; done

array() { sbatch --parsable --array="1-$1" --cpus-per-task=1 --output="log/%A_%a" "$here/../examples/slurm_simulate.sh" "$motions" "$2" --device consumer_mems; }
ended() { while [ -n "$(squeue --noheader)" ]; do sleep 0.1; done; }
columns() { find "$1" -name '*.parquet' | wc -l; }
timed() {
    begun=$(date +%s%N)
    array "$1" "$2" > /dev/null
    ended
    echo "$1 task(s): $(columns "$2") files in $((($(date +%s%N) - begun) / 1000000)) ms"
}

timed 1 one
timed 2 two
job=$(array 4 killed)
until [ -d killed ] && [ "$(columns killed)" -ge 8 ]; do sleep 0.05; done
scancel --signal=KILL --full "${job}_2"
ended
left=$(columns killed)
job=$(array 3 killed)
ended
echo "a killed task left $left of $(columns one) files; the array again wrote $(cat "log/${job}_"* | grep -c '\.parquet: ')"
for other in two killed; do
    diff -rq --exclude='manifest*' one "$other"
done
echo "the same bytes from one task, two, and four with one killed"
