#!/usr/bin/env bash
# Instructions per keyframe and stage on x86-64, aarch64 and ARMv7, counted in qemu's user mode.
#
#   run.sh [DATASET [SENSOR]]     without arguments KITTI's drive 0005 out of ../shared/data
#
# Equal machine code gives equal counts, whatever the load of this machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

out=build/bench
mkdir -p "$out"
dataset=${1:-}
sensor=${2:-hdl-64e}
if [ -z "$dataset" ]; then
  [ -e ../shared/data/unpack.sh ] || {
    echo "error: no recordings beside the project; name a data set: bench/arm/run.sh DATASET [SENSOR]" >&2
    exit 1
  }
  dataset=$(sh ../shared/data/unpack.sh "$out/recordings")/kitti_0005a
fi

plugin="$out/count_instructions.so"
gcc -O2 -shared -fPIC -fvisibility=hidden -o "$plugin" bench/arm/count_instructions.c

# count PRESET EMULATOR [EMULATOR ARGS]: builds what the preset makes, and runs it.
count() {
  local preset=$1 emulator=$2
  shift 2
  cmake --preset "$preset" -Wno-dev >"$out/$preset.log"
  cmake --build "build/$preset" --target stage_instructions >>"$out/$preset.log"
  "$emulator" "$@" -plugin "$plugin" "build/$preset/bin/stage_instructions" "$dataset" "$sensor" \
    >"$out/$preset.instructions"
}

library_path() { echo "LD_LIBRARY_PATH=build/package-roots/$1/usr/lib/$2"; }

count release qemu-x86_64
count aarch64 qemu-aarch64 -L /usr/aarch64-linux-gnu -E "$(library_path arm64 aarch64-linux-gnu)"
count armv7-neon qemu-arm -L /usr/arm-linux-gnueabihf -E "$(library_path armhf arm-linux-gnueabihf)"

{
echo "| million instructions per keyframe, $(basename "$dataset") | x86-64 | aarch64 | ARMv7 + NEON |"
echo "|---|---|---|---|"
join "$out/release.instructions" "$out/aarch64.instructions" --nocheck-order |
  join - "$out/armv7-neon.instructions" --nocheck-order |
  awk '{printf "| %s | %.2f | %.2f (%.2f x) | %.2f (%.2f x) |\n", $1, $2 / 1e6,
        $3 / 1e6, $3 / $2, $4 / 1e6, $4 / $2}'
} | bench/tables/table.sh arm-instructions
