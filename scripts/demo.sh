#!/usr/bin/env bash
# The main job in one command: the identification run and the knee chirp on the simulated rig, their logs, their reports.
#
#   scripts/demo.sh            short runs, well under a minute once the environment is made
#   scripts/demo.sh --full     all seven trials of 200 s and the five minutes of chirp
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/env.sh"
cd "$root"
out=$root/out/demo
short=_short
[ "${1:-}" = "--full" ] && short=
rm -rf "$out"
mkdir -p "$out"

echo "== what would move (nothing does) =="
epa run "config/experiments/identification$short.yaml" --rig config/rigs/bench.yaml --dry -o "$out"
for job in "identification$short bench" "identification$short bench_analog" "knee_chirp$short knee"; do
    read -r experiment rig <<<"$job"
    echo
    echo "== $experiment on the simulated $rig =="
    epa run "config/experiments/$experiment.yaml" --rig "config/rigs/$rig.yaml" --backend sim -o "$out"
    log=$(ls "$out/$experiment-$rig-"*.mcap | tail -n 1)
    epa report "$log" --html "${log%.mcap}.html"
done
echo
echo "== the same controllers over the recorded inputs: is every byte the same? =="
epa replay "$out"/*.mcap
echo
echo "logs and reports are in $out"
ls -1 "$out"
