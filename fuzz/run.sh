#!/usr/bin/env bash
# Fuzzes one target on stable Rust: fuzz/run.sh TARGET SECONDS [options of libFuzzer].
# Inputs that find new code are kept in grown/TARGET; a find, the input that broke a promise, in
# artifacts/TARGET. Each run adds a line to runs.tsv: target, seconds, executions, coverage, whether it
# ended with a find, and, where it was kept, seconds of processor time.
set -euo pipefail
cd "$(dirname "$0")"
target=$1 seconds=$2
shift 2
# What cargo-fuzz passes to the compiler, but for the sanitizers, which stable does not have: all
# unsafe code is in one file, and Miri looks after that.
coverage="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares --cfg=fuzzing -Cllvm-args=-simplifycfg-branch-fold-threshold=0"
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
triple=$(rustc -vV | sed -n 's/^host: //p')
RUSTFLAGS="$coverage" cargo build -q --release --target "$triple" --bin "$target"
mkdir -p "grown/$target" "artifacts/$target" "corpus/$target"
[ -d /dev/shm ] && export TMPDIR=/dev/shm
log=$(mktemp)
# Hundredths of a second of processor time of what this shell waited for.
cpu() { read -ra stat <"/proc/$$/stat"; echo "$((stat[15] + stat[16]))"; }
trap 'rm -f "$log"' EXIT
code=0
before=$(cpu)
"$CARGO_TARGET_DIR/$triple/release/$target" "grown/$target" "corpus/$target" -max_total_time="$seconds" \
    -artifact_prefix="artifacts/$target/" -timeout=30 -rss_limit_mb=2048 -max_len=6000 -print_final_stats=1 "$@" >"$log" 2>&1 || code=$?
grep -aE '^(SUMMARY|thread|  left|  right|Test unit|artifact_prefix)|panicked' -A2 "$log" | head -40 || true
stat() { sed -n "s/^stat::$1: *//p" "$log" | tail -1; }
# A run that ends with its first input says neither.
cover=$(grep -aoE 'cov: [0-9]+' "$log" | tail -1 | cut -d' ' -f2 || true)
took=$(grep -aoE 'in [0-9]+ second' "$log" | tail -1 | cut -d' ' -f2 || true)
printf '%s\t%s\t%s\t%s\t%s\t%s\n' "$target" "${took:-$seconds}" "$(stat number_of_executed_units)" "${cover:-0}" \
    "$([ "$code" = 0 ] && echo none || echo find)" "$((($(cpu) - before) / 100))" | tee -a runs.tsv
exit "$code"
