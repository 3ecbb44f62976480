#!/usr/bin/env bash
# A run in shards as an array of Slurm, without Snakemake: every task of the array traces one shard, a task without
# a number in the array joins them. Needs a folder that all nodes see, and the programs on the PATH.
#
#   id=$(sbatch --parsable --array=1-64 workflow/slurm.sh 64 scenes/hall/scene.toml run 100M)
#   sbatch --dependency=afterok:"$id" workflow/slurm.sh 64 scenes/hall/scene.toml run 100M
#
# A task that failed is called again with its number alone: sbatch --array=17 workflow/slurm.sh 64 …
#
#SBATCH --job-name=sonel
#SBATCH --cpus-per-task=8
#SBATCH --mem=4G
#SBATCH --time=04:00:00

set -euo pipefail

if [[ $# -lt 4 ]]; then
    echo "usage: slurm.sh SHARDS SCENE.toml FOLDER SONELS [options of sonel-trace]" >&2
    exit 2
fi
shards=$1 scene=$2 folder=$3 sonels=$4
shift 4
mkdir -p "$folder/shards"

if [[ -n ${SLURM_ARRAY_TASK_ID:-} ]]; then
    exec sonel-trace "$scene" -o "$folder/shards/$SLURM_ARRAY_TASK_ID.sonelmap" --sonels "$sonels" \
        --shard "$SLURM_ARRAY_TASK_ID/$shards" --threads "${SLURM_CPUS_PER_TASK:-1}" "$@"
fi

maps=()
for ((index = 1; index <= shards; index++)); do
    maps+=("$folder/shards/$index.sonelmap")
done
exec sonel-analyze merge "${maps[@]}" -o "$folder/map.sonelmap"
