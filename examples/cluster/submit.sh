#!/usr/bin/env bash
# A study as a Slurm job array, one shard a task, and the merger as a job that waits for all of them.
#
#   ./submit.sh STUDY.toml FILE.h5 [SHARDS]
#
# Twenty shards unless SHARDS says otherwise. More shards than nodes balance better; the points are dealt out like cards,
# so that neighbours in the parameters, which take about as long, go to different shards. The shards are kept in
# FILE.shards/: after a failure the same command goes on with what is left of them, and remade is only what is missing.
# What a cluster wants beside (account, partition, time) is given to sbatch by its variables, such as SBATCH_ACCOUNT,
# SBATCH_PARTITION and SBATCH_TIMELIMIT, or in shard.sbatch. STICKSLIP names the program, if it is not in the PATH.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
study=${1:?give a study, a file for the result, and how many shards}
result=${2:?give a file for the result}
shards=${3:-20}
folder=${result%.h5}.shards
mkdir -p "$folder/log"

# --parsable prints the number of the job alone (after it, on some clusters, the cluster's name).
array=$(sbatch --parsable --array="1-$shards" --output="$folder/log/%a.log" \
  "$here/shard.sbatch" "$study" "$folder")
array=${array%%;*}
# afterok: when every task of the array has ended well. Else the merger would wait for ever; it is removed instead.
merger=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$folder/log/merge.log" \
  "$here/merge.sbatch" "$folder" "$shards" "$result")
merger=${merger%%;*}
echo "array $array, merger $merger, logs in $folder/log"
