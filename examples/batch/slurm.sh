#!/bin/sh
#SBATCH --job-name=slew-batch
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
#SBATCH --requeue
# examples/batch/slurm.sh - a batch as a Slurm job array, a shard a task.  A task
# that is requeued goes on where it was.
#
#   sbatch slurm.sh DIRECTORY
#
# When all tasks have ended:
#
#   slew batch --merge --out all.csv --plot all.png shard-*.csv
set -eu
exec "${SLEW:-slew}" batch --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
    --jobs "${SLURM_CPUS_PER_TASK:-1}" --runs 100000 --seed 1 \
    --vary '*.mass=0.5..2' --out "shard-$SLURM_ARRAY_TASK_ID.csv" "$1"
