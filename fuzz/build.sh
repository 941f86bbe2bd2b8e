#!/bin/sh
# Builds all targets with what cargo-fuzz passes for `-s none`, which a stable compiler accepts.
# Run from anywhere; more arguments go to cargo.
set -eu
cd "$(dirname "$0")"
RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module \
-Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
-Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares \
-Cllvm-args=-simplifycfg-branch-fold-threshold=0" \
    cargo build --release --bins --target "$(rustc -vV | sed -n 's/^host: //p')" "$@"
