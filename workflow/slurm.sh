#!/usr/bin/env bash
# A run in shards on Slurm, without Snakemake. Called on a login node it submits three jobs: one decides about effects, an array traces
# the shards, one joins them. Needs a folder that all nodes see, and the programs on the PATH.
#
#   workflow/slurm.sh 64 scenes/hall/scene.toml run 100M
#   SBATCH_OPTIONS="--account=NAME --cpus-per-task=8 --mem=2G" workflow/slurm.sh 64 scenes/hall/scene.toml run 100M --batches 64
#
# A task that failed is traced again alone, then the shards are joined; what a killed task left is removed by the next:
#
#   SONEL_STAGE=trace sbatch --array=17 --mem=4G workflow/slurm.sh 64 scenes/hall/scene.toml run 100M
#   SONEL_STAGE=join sbatch workflow/slurm.sh 64 scenes/hall/scene.toml run 100M
#
# A task of a failed node is queued again. docs/scale.md says what jobs take.
#SBATCH --job-name=sonel
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue

set -euo pipefail

if [[ $# -lt 4 ]]; then
    echo "usage: slurm.sh SHARDS SCENE.toml FOLDER PACKETS [options of sonel-trace]" >&2
    exit 2
fi
arguments=("$@")
shards=$1 scene=$2 folder=$3 packets=$4
shift 4
threads=(--threads "${SLURM_CPUS_PER_TASK:-1}")

# Submits a stage with options of sbatch; prints its number.
submit() {
    local stage=$1
    shift
    # shellcheck disable=SC2086 # several options
    SONEL_STAGE=$stage sbatch --parsable --output="$folder/logs/$stage-%A-%a.log" ${SBATCH_OPTIONS:-} "$@" "$0" "${arguments[@]}"
}

case ${SONEL_STAGE:-submit} in
submit)
    mkdir -p "$folder/shards" "$folder/logs"
    # A job whose dependency fails would wait for ever.
    after=(--kill-on-invalid-dep=yes)
    decided=$(submit decide)
    traced=$(submit trace --array="1-$shards" --dependency="afterok:$decided" "${after[@]}")
    joined=$(submit join --dependency="afterok:$traced" "${after[@]}")
    echo "submitted: decide $decided, trace $traced, join $joined; the map will be $folder/map.sonelmap"
    ;;
decide)
    exec sonel-trace "$scene" -o "$folder/decision.sonelmap" --packets 1 "${threads[@]}" "$@"
    ;;
trace)
    exec sonel-trace "$scene" -o "$folder/shards/$SLURM_ARRAY_TASK_ID.sonelmap" --packets "$packets" \
        --shard "$SLURM_ARRAY_TASK_ID/$shards" --decision "$folder/decision.sonelmap" "${threads[@]}" "$@"
    ;;
join)
    maps=()
    for ((index = 1; index <= shards; index++)); do
        maps+=("$folder/shards/$index.sonelmap")
    done
    exec sonel-analyze merge "${maps[@]}" -o "$folder/map.sonelmap"
    ;;
*)
    echo "SONEL_STAGE is \"$SONEL_STAGE\": decide, trace or join" >&2
    exit 2
    ;;
esac
