#!/usr/bin/env bash
# Checks how `marrow view` fails: with one line and an exit code, before Qt starts.
# usage: view_test.sh BIN      BIN: the folder of the programs
set -uo pipefail
marrow=$(realpath "$1")/marrow
faults=0
screen=(env -u DISPLAY -u WAYLAND_DISPLAY -u QT_QPA_PLATFORM)

# fails_with CODE TEXT ARGUMENT...: the program must exit with CODE and print one line that contains TEXT.
fails_with() {
  local wanted=$1 text=$2 err code
  shift 2
  err=$("${screen[@]}" "$marrow" "$@" 2>&1 > /dev/null)
  code=$?
  if [ "$code" -ne "$wanted" ] || [[ $err != *"$text"* ]] || [ "$(wc -l <<< "$err")" -ne 1 ]; then
    echo "marrow $* exits with $code and prints: $err" >&2
    faults=$((faults + 1))
  fi
}

fails_with 3 "needs a display" view
fails_with 3 "needs a display" view /
fails_with 3 "'missing.nrrd': there is no such file" view missing.nrrd
fails_with 2 "did you mean --series?" view --serie 1
fails_with 2 "--measure needs an INPUT" view --measure
fails_with 2 "need an INPUT" view --spacing 1,1,1
fails_with 2 "a session has its own options" view missing.marrow --volume 0

# A screen without OpenGL is none. With -noreset it stays as it is when the program leaves; xvfb-run can take the signal
# that it has started again for a failure to clean up.
if command -v xvfb-run > /dev/null; then
  screen=("${screen[@]}" xvfb-run -a -s "-extension GLX -noreset")
  fails_with 3 "lacks its extension GLX" view
else
  echo "skipped: there is no xvfb-run to start a screen without OpenGL"
fi
[ "$faults" -eq 0 ]
