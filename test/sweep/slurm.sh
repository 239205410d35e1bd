#!/bin/bash
# SPDX-License-Identifier: MIT
# A grid of 10,080 runs as an array job of Debian's Slurm, two nodes of one core on this machine. One node is killed in
# the middle of its work with all that runs on it, and comes back; one shard is computed twice. The merged result is that
# of one process, to the byte.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/../cli/common.sh"
here=$(realpath "$(dirname "$0")/../..")
for program in slurmctld slurmd sbatch squeue; do
  command -v $program > /dev/null || { echo "SKIPPED: no $program here (Debian: slurm-wlm)"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "SKIPPED: a slurmd needs root"; exit 77; }
cd "$folder" || exit 1
host=$(hostname -s)
port=$((20000 + 4 * ($$ % 5000)))
mkdir state
export SLURM_CONF=$folder/slurm.conf FTCS=$ftcs
cat > slurm.conf << EOT
ClusterName=ftcs
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/none
CredType=cred/none
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool-%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd-%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SlurmdTimeout=10
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
NodeName=one NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 State=UNKNOWN
NodeName=two NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 State=UNKNOWN
PartitionName=all Nodes=one,two Default=YES MaxTime=INFINITE State=UP
EOT
slurmctld -D > ctl.out 2>&1 &
pids+=($!)
start_node() { slurmd -D -N "$1" > "$1.out" 2>&1 & pids+=($!); node[$1]=$!; }
declare -A node
start_node one
start_node two
idle() { [ "$(sinfo -h -t idle -o %D 2> /dev/null)" = 2 ]; }
for _ in $(seq 60); do idle && break; sleep 1; done
idle || fail "the cluster does not start: $(sinfo 2>&1)"

sweep=(simulate "$here/experiments/one-way-grid/grid.toml" --seeds 72)
sbatch --array=1-40 --output="$folder/task-%a.out" "$here/examples/cluster/sweep.sbatch" parts "${sweep[@]}" > job.txt ||
  fail "sbatch"
parts() { find parts -name 'shard-*.json' 2> /dev/null | wc -l; }
waiting() { squeue -h -r | wc -l; }
for _ in $(seq 300); do [ "$(parts)" -ge 4 ] && break; sleep 0.5; done
[ "$(waiting)" -gt 4 ] || fail "too quick: nothing is left to kill"

# The end of a machine: the node's daemon, the steps that it started and their programs, at once.
for _ in $(seq 300); do
  running=$(squeue -h -r -w two -t running -o %A | head -1)
  victims=$([ -z "$running" ] || pgrep -f "slurmstepd: \[$running\.")
  [ -n "$victims" ] && break
  sleep 0.1
done
[ -n "$victims" ] || fail "nothing ran on node two"
kill -9 "${node[two]}"
for step in $victims; do
  for child in $(pgrep -P "$step"); do pkill -9 -P "$child"; kill -9 "$child"; done
  kill -9 "$step"
done 2> /dev/null
echo "killed node two at $(parts) of 40 shards, with job $running"
for _ in $(seq 60); do [ "$(sinfo -h -n two -o %t | tr -d '*')" = down ] && break; sleep 1; done
[ "$(sinfo -h -n two -o %t | tr -d '*')" = down ] || fail "the death of a node was not noticed: $(sinfo)"
scontrol show job "$running" | grep -q 'Restarts=1' || fail "job $running was not requeued: $(scontrol show job "$running")"
start_node two

for _ in $(seq 600); do [ "$(waiting)" = 0 ] && break; sleep 1; done
[ "$(parts)" = 40 ] || fail "$(parts) of 40 shards: $(squeue)"
"$ftcs" "${sweep[@]}" --shard 7/40 -q --json again.json || fail "a shard once more"
"$ftcs" "${sweep[@]}" -q --merge parts/*.json again.json --json merged.json || fail "merge"
"$ftcs" "${sweep[@]}" -q --json whole.json || fail "one process"
cmp whole.json merged.json || fail "the merged result differs from that of one process"
echo "40 shards, one node killed, one shard twice: $(python3 -c "
import json
print(sum(r['runs'] for r in json.load(open('whole.json'))['suite']))") runs, merged result identical"
