#!/usr/bin/env bash
# Checks that the programs run the same where Vulkan has no driver, or is not installed at all.
# usage: without_vulkan_test.sh BIN      BIN: the folder of the programs
set -uo pipefail
marrow=$(realpath "$1")/marrow
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
faults=0

fault() {
  echo "$*" >&2
  faults=$((faults + 1))
}

# expect CODE TEXT PROGRAM ARGUMENT...: the program exits with CODE and prints one line, which contains TEXT.
expect() {
  local wanted=$1 text=$2 output code
  shift 2
  output=$("$@" 2>&1)
  code=$?
  if [ "$code" -ne "$wanted" ] || [[ $output != *"$text"* ]] || [ "$(wc -l <<< "$output")" -ne 1 ]; then
    fault "$* exits with $code and prints: $output"
  fi
}

# A scan of 3 x 3 x 3 samples, of which the middle one is inside.
{
  printf 'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 3\nspace: left-posterior-superior\n'
  printf 'space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n'
  printf '%s' 0000000000000100000000000000
} > scan.nrrd
"$marrow" scan.nrrd -o expected.ply --isovalue 48.5 -q || fault "marrow cannot read the scan"

# check REASON: runs the programs in the environment as it is.
check() {
  expect 0 "no devices: $1" "$marrow" devices
  expect 3 "there is no GPU: $1" "$marrow" scan.nrrd -o out.ply --isovalue 48.5 --device gpu
  expect 3 "there is no device '0': $1" "$marrow" scan.nrrd -o out.ply --isovalue 48.5 --device 0
  [ ! -x "${marrow}-viewer" ] || expect 3 "there is no GPU: $1" "$marrow" view --device gpu
  for device in cpu auto; do
    rm -f out.ply
    "$marrow" scan.nrrd -o out.ply --isovalue 48.5 -q --device "$device" 2>&1 || fault "--device $device fails"
    cmp expected.ply out.ply || fault "--device $device gives another file"
  done
}

# The reasons are those of a build with Vulkan, or that of a build without.
built=$("$marrow" devices | grep -o "Marrow was built without Vulkan")
(
  export VK_ICD_FILENAMES=$work/none.json VK_DRIVER_FILES=$work/none.json
  check "${built:-no Vulkan driver is installed}"
  exit "$faults"
) || faults=1
# An empty file in place of the loader cannot be loaded.
mkdir loader
touch loader/libvulkan.so.1 loader/libvulkan.so
(
  export LD_LIBRARY_PATH=$work/loader
  check "${built:-the Vulkan loader, libvulkan.so.1, is not installed}"
  exit "$faults"
) || faults=1
[ "$faults" -eq 0 ]
