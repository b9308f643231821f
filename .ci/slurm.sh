#!/usr/bin/env bash
# Runs a command beside a Slurm of one node, this machine, with a queue for all of its processors:
#
#   .ci/slurm.sh COMMAND [ARGUMENT...]
#
# Needs the packages slurm-wlm and munge, and root. Everything that Slurm and munge write, their sockets and their ports
# are its own, so that it disturbs no other Slurm; without systemd, cgroups and accounting. At the end the daemons are
# ended by their numbers, however the command ended, whose exit status is passed on.
set -euo pipefail
(($# > 0)) || { echo "usage: $0 COMMAND [ARGUMENT...]" >&2; exit 2; }
[[ $(id -u) == 0 ]] || { echo "$0: has to run as root: slurmd starts jobs in the name of users" >&2; exit 2; }
folder=$(mktemp -d /tmp/slurm.XXXXXX)
# munge refuses to work in a folder that others can write to.
chmod 755 "$folder"
mkdir "$folder/munge" "$folder/state" "$folder/spool"
daemons=()

end() {
  local daemon
  # In the reverse of their order, and the jobs first.
  scancel --user="$(id -un)" 2>/dev/null || true
  for ((k = ${#daemons[@]} - 1; k >= 0; k--)); do
    daemon=${daemons[k]}
    kill "$daemon" 2>/dev/null || true
    for _ in {1..50}; do
      kill -0 "$daemon" 2>/dev/null || break
      sleep 0.1
    done
    kill -KILL "$daemon" 2>/dev/null || true
  done
  rm -rf "$folder"
}
trap end EXIT

complain() {
  echo "$0: $1" >&2
  tail -n 20 "$folder"/*.log >&2 || true
  exit 1
}

# A port on which nobody listens.
free_port() {
  local port
  for port in $(shuf -i 20000-30000 -n 50); do
    if ! (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then
      echo "$port"
      return
    fi
  done
  complain "no free port"
}

host=$(uname -n)
host=${host%%.*}
head -c 1024 /dev/urandom >"$folder/munge/key"
chmod 600 "$folder/munge/key"
cat >"$folder/slurm.conf" <<CONFIGURATION
ClusterName=checks
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
AuthType=auth/munge
# A job that is queued again waits until credentials have expired.
AuthInfo=socket=$folder/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,batch_sched_delay=0
SlurmdParameters=config_overrides
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONFIGURATION
# The daemons look for the folder of cgroups even if no plugin asks for them.
printf 'CgroupMountpoint=%s/cgroup\nCgroupPlugin=cgroup/v1\n' "$folder" >"$folder/cgroup.conf"
export SLURM_CONF=$folder/slurm.conf

munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" \
  --pid-file="$folder/munge/pid" --seed-file="$folder/munge/seed" --log-file="$folder/munge.log" \
  >"$folder/munged.log" 2>&1 &
daemons+=($!)
for _ in {1..100}; do
  [[ -S $folder/munge/socket ]] && break
  sleep 0.1
done
slurmctld -D >"$folder/slurmctld-output.log" 2>&1 &
daemons+=($!)
slurmd -D -N "$host" >"$folder/slurmd-output.log" 2>&1 &
daemons+=($!)
for _ in {1..60}; do
  state=$(sinfo --noheader --format=%T 2>/dev/null || true)
  [[ $state == idle ]] && break
  sleep 0.5
done
[[ $state == idle ]] || complain "the node does not come up: ${state:-no answer}"
"$@"
