#!/bin/sh
# Runs one target for a number of seconds: run.sh TARGET SECONDS [options of libFuzzer].
# What is found is left in artifacts/TARGET/.
set -eu
target=$1
seconds=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
scenes="$here/../assets/pbrt-v3-scenes-subset"
corpus="$here/corpus/$target"
mkdir -p "$corpus" "$here/artifacts/$target"
take() {
    find "$scenes" -type f -name "$1" -size -64k -exec cp -n {} "$corpus" \;
}
options=
case $target in
parse | describe | check)
    take '*.pbrt'
    cp "$here"/seeds/parse/* "$here"/seeds/check/* "$corpus"
    options=-dict=$here/scene.dict
    ;;
exr | png) take "*.$target" ;;
esac
if [ -d "$here/seeds/$target" ]; then cp "$here/seeds/$target"/* "$corpus"; fi
host=$(rustc -vV | sed -n 's/^host: //p')
program=${CARGO_TARGET_DIR:-$here/target}/$host/release/$target
# One thread, so that time is that of a single core; memory ends with the allocator of the target, or here.
RAYON_NUM_THREADS=1 exec "$program" "$corpus" $options \
    -max_total_time="$seconds" -timeout=10 -rss_limit_mb=4096 -max_len=65536 \
    -artifact_prefix="$here/artifacts/$target/" -print_final_stats=1 "$@"
