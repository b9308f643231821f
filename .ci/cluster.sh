#!/usr/bin/env bash
# One machine and a Slurm job array of four give identical files:
#
#   .ci/slurm.sh .ci/cluster.sh PROGRAM FOLDER
#
# by the scripts of examples/cluster, with a task that is taken off its node on the way and started again. FOLDER is made.
set -euo pipefail
program=$1
folder=$2
examples=$(cd "$(dirname "$0")/../examples/cluster" && pwd)
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"

# A map of which a part is no valid case; ten seconds on one thread.
cat >map.toml <<'STUDY'
title = "sticks over damping and decay"
case = "paper"
[set]
solver.method = "series"
perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-6 }]
[[axis]]
key = "friction.low_speed"
values = [0.5, 0.6, 0.7]
[[axis]]
key = "torsion.damping"
from = 10
to = 60
count = 80
[[axis]]
key = "friction.decay"
from = 2
to = 150
count = 60
spacing = "log"
[keep]
events = true
STUDY

complain() {
  echo "$0: $1" >&2
  squeue >&2 || true
  tail -n 20 ./*.shards/log/*.log ./*.log >&2 2>/dev/null || true
  exit 1
}

# wait_for WHAT COMMAND...: until the command succeeds, for three minutes at most.
wait_for() {
  local what=$1
  shift
  for _ in {1..1800}; do
    "$@" >/dev/null 2>&1 && return
    sleep 0.1
  done
  complain "$what"
}
# A controller that does not answer in time is no sign that the job has ended. (%F is the number of a whole array.)
is_gone() {
  local queue
  queue=$(squeue --noheader --format=%F) && ! grep -qx "$1" <<<"$queue"
}
has_points() { [[ $(stat --format=%s "$1" 2>/dev/null || echo 0) -gt 20000 ]]; }
restarted() { [[ $(scontrol show job "$1" | sed -n 's/.*Restarts=\([0-9]*\).*/\1/p' | head -n 1) -ge 1 ]]; }

"$program" sweep map.toml --quiet --output one.h5

submitted=$(STICKSLIP=$program "$examples/submit.sh" map.toml array.h5 4)
echo "$submitted"
array=$(sed -E 's/array ([0-9]+),.*/\1/' <<<"$submitted")
merger=$(sed -E 's/.*merger ([0-9]+),.*/\1/' <<<"$submitted")
wait_for "no task of the array began" has_points array.shards/1.journal
scontrol requeue "${array}_1"
wait_for "the task was not started again" restarted "${array}_1"
wait_for "the array and its merger do not end" is_gone "$merger"
[[ -f array.h5 ]] || complain "the merger left no file"
grep -q "of them now" array.shards/log/1.log || complain "the task that was started again did not go on"
cmp one.h5 array.h5
echo "a job array of four: the bytes of one machine, a task of it having been queued again"

# The same command once more finds everything done, and is told that the result exists.
submitted=$(STICKSLIP=$program "$examples/submit.sh" map.toml array.h5 4)
wait_for "the second array does not end" is_gone "$(sed -E 's/.*merger ([0-9]+),.*/\1/' <<<"$submitted")"
[[ $(cat array.shards/log/?.log | grep -c "none of them run now") == 4 ]] || complain "a shard was run again"
grep -q "array.h5: exists" array.shards/log/merge.log || complain "the result was replaced"
