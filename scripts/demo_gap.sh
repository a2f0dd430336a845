#!/usr/bin/env bash
# Why do rig and simulation disagree? A rig played by a second simulator hides an effect; the diagnosis names it, patches
# the plant file, runs it again, and draws the gap before and after. Under two minutes once the environment is made.
#
#   scripts/demo_gap.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/env.sh"
cd "$root"
out=out/demo_gap
rm -rf "$out"
mkdir -p "$out"

echo "== a rig whose plant file lacks something =="
python scripts/demo_gap_rig.py "$out"
echo
echo "== where is the gap, what causes it, how far does it shrink on an unseen log? =="
epa gap diagnose --rig config/rigs/bench.yaml "$out/real_1.mcap" "$out/real_2.mcap" --holdout "$out/held_out.mcap" --no-plan \
    --json "$out/gap.json" --html "$out/gap.html" -o "$out/bench_patched.yaml" --picture "$out/gap.svg"
echo
echo "== and what had been hidden: =="
cat "$out/hidden.txt"
echo
echo "the report is $out/gap.html"
echo "the picture is $out/gap.svg, the patched plant $out/bench_patched.yaml"
