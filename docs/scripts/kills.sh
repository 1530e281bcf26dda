#!/usr/bin/env bash
# Kills a job of pictures at random times, repeatedly, and checks the files that are left.
#
#   bash docs/scripts/kills.sh target/release/blinn models/cornell/cornell.glb 200
#
# Every existing picture must be decodable, and a last run must complete the job with the same files as an
# uninterrupted one. Needs Python with Pillow.
set -euo pipefail
blinn=$(realpath "$1") scene=$(realpath "$2") kills=${3:-200}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
job=("$blinn" turntable "$scene" --count 20 --size 160x90 --resume -q -o)

started=$(date +%s%N)
"${job[@]}" "whole/####.png"
took=$((($(date +%s%N) - started) / 1000000))
undecodable=0 rounds=0 finished=0
for ((i = 0; i < kills; i++)); do
    # Start again once all are complete.
    if [ "$(find killed -name '*.png' 2>/dev/null | wc -l)" = 20 ]; then
        diff -rq whole killed >&2
        rm -rf killed
        rounds=$((rounds + 1))
    fi
    # No function: it would run in a subshell, which would be killed in place of the program.
    "${job[@]}" "killed/####.png" &
    pid=$!
    sleep "$(awk -v r="$RANDOM" -v t="$took" 'BEGIN { print r / 32768 * t / 1000 / 2 }')"
    kill -9 "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null && finished=$((finished + 1))
    undecodable=$((undecodable + $(python3 - <<'PY'
import glob
from PIL import Image

bad = 0
for name in glob.glob("killed/*.png"):
    try:
        Image.open(name).load()
    except Exception:
        bad += 1
print(bad)
PY
    )))
    # A file that a killed process was writing keeps its temporary name.
    rm -f killed/.blinn-*.part
done
"${job[@]}" "killed/####.png"
diff -r whole killed
echo "$kills kills, $finished of them after the end; $rounds jobs completed meanwhile; $undecodable files undecodable," \
    "all others identical to an uninterrupted job"
[ "$undecodable" = 0 ]
