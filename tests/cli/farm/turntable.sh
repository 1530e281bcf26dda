#!/bin/bash
#SBATCH --job-name=turntable-cube
#SBATCH --array=1-3%2
#SBATCH --requeue
#SBATCH --cpus-per-task=2
#SBATCH --mem=1024M
#
# 12 frames in 3 tasks. Run this file with `bash` to submit them; its arguments, such as
# --partition=render, are passed to sbatch. BLINN is the program if it is not in PATH.
set -euo pipefail
blinn=${BLINN:-blinn}

if [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then
    cd -- "$(dirname -- "$0")"
    frames=$(sbatch --parsable "$@" "./${0##*/}")
    echo "frames: job ${frames%%;*}"
    exit
fi

exec "$blinn" turntable cube.obj '--output=out/{stem}_##.png' '--count=12' '--samples=1' '--size=32x18' '--exposure=0' '--view-point=3.0425770759407733,1.9052558883257649,4.259607906317083' '--view-dir=-0.5461852415567653,-0.3420201433256687,-0.7646593381794714' '--view-up=-0.19879517032215818,0.9396926207859084,-0.2783132384510214' '--proj-distance=1' '--view-width=1.2941163885020528' '--view-height=0.7279404685324047' '--projection=perspective' '--clip=off' '--max-memory=1073741824' '--only=1-12' \
    --chunk="$SLURM_ARRAY_TASK_ID/3" --threads=2 --resume --progress=plain
