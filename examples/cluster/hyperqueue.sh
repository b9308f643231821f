#!/usr/bin/env bash
# A study as tasks of HyperQueue, which packs many short tasks into few jobs of Slurm or PBS:
#
#   ./hyperqueue.sh STUDY.toml FILE.h5 [SHARDS]
#
# Before it, once: hq server start &, and workers, either by hand (hq worker start &) or from the batch system, such as
# hq alloc add slurm --time-limit 1h -- --partition=main. STICKSLIP names the program, if it is not in the PATH.
set -euo pipefail
study=${1:?give a study, a file for the result, and how many shards}
result=${2:?give a file for the result}
shards=${3:-20}
program=${STICKSLIP:-stickslip}
folder=${result%.h5}.shards
mkdir -p "$folder/log"

# Tasks are numbered by --array, and each finds its number in HQ_TASK_ID. One that is lost with its worker is started
# again, and --resume goes on with what it has done. --wait: until all have ended.
# shellcheck disable=SC2016 # the variables are the task's
hq submit --wait --array "1-$shards" --cpus 1 --stdout "$folder/log/%{TASK_ID}.log" --stderr "$folder/log/%{TASK_ID}.log" \
  -- bash -c 'exec "$0" sweep "$1" --shard "$HQ_TASK_ID/$3" --resume --jobs 1 --output "$2/$HQ_TASK_ID.h5"' \
  "$program" "$study" "$folder" "$shards"

# --wait does not say whether they ended well; the merger does, and names what is missing.
files=()
for ((shard = 1; shard <= shards; shard++)); do
  files+=("$folder/$shard.h5")
done
exec "$program" merge "${files[@]}" --output "$result"
