#!/usr/bin/env bash
# Checks that the completions and the manual pages name all options of the programs, and no others.
# usage: completions_test.sh BIN PACKAGING      BIN: the folder of the programs
set -uo pipefail
bin=$(realpath "$1")
packaging=$(realpath "$2")
faults=0

fault() {
  echo "$*" >&2
  faults=$((faults + 1))
}

# The options in the help that the rest of the arguments print, one a line.
options_in_help() {
  "$@" --help | sed -nE 's/^  ((-[a-z],)?--[a-z-]+).*/\1/p' | tr ',' '\n' | sort
}

# The options that bash offers after the command line "$@ -".
options_in_bash() {
  COMP_WORDS=("$@" -)
  COMP_CWORD=$#
  _marrow
  printf '%s\n' "${COMPREPLY[@]}" | sort
}

# The options in a function of the zsh completion.
options_in_zsh() {
  sed -n "/^$1() {/,/^}/p" "$packaging/completions/_marrow" |
    sed -nE "s/^    '(\([^']*\))?\*?'?(\{([^}]*)\}|(--[a-z-]+)).*/\3\4/p" | tr ',' '\n' | sort
}

# The options in a manual page, from a section to the next.
options_in_man() {
  sed -n "/^\.SH $2\$/,/^\.SH/p" "$packaging/man/$1" | sed -n '/^\.TP/{n;p}' |
    sed -E 's/\\f[BRI]//g; s/\\-/-/g' | grep -oE '(^|[ ,])--?[a-z][a-z-]*' | tr -d ' ,' | sort
}

# check WHAT WANTED FOUND: compares two lists.
check() {
  [ -n "$2" ] || fault "$1: the help has no options"
  [ "$2" = "$3" ] || fault "$1 differs from the help (<: only in the help, >: only here):
$(diff <(echo "$2") <(echo "$3") | grep '^[<>]')"
}

# check_command FUNCTION PAGE SECTION COMMAND...: checks one command.
check_command() {
  local zsh_function=$1 page=$2 section=$3 wanted
  shift 3
  wanted=$(options_in_help "$bin/$1" "${@:2}")
  check "bash completion of '$*'" "$wanted" "$(options_in_bash "$@")"
  check "zsh completion of '$*'" "$wanted" "$(options_in_zsh "$zsh_function")"
  check "$page of '$*'" "$wanted" "$(options_in_man "$page" "$section")"
}

# check_words WANTED WORD...: checks what bash offers for the last word.
check_words() {
  local wanted=$1
  shift
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _marrow
  local offered
  offered=$(printf '%s\n' "${COMPREPLY[@]}" | sort | paste -sd ' ')
  wanted=$(tr ' ' '\n' <<< "$wanted" | sort | paste -sd ' ')
  [ "$offered" = "$wanted" ] || fault "bash offers '$offered' after '$*', not '$wanted'"
}

# shellcheck source=/dev/null
. "$packaging/completions/marrow.bash"
check_command _marrow_extract marrow.1 OPTIONS marrow
check_command _marrow_info marrow.1 "MARROW INFO" marrow info
check_command _marrow_check marrow.1 "MARROW CHECK" marrow check
check_command _marrow_sweep marrow.1 "MARROW SWEEP" marrow sweep
check_command _marrow_devices marrow.1 "MARROW DEVICES" marrow devices
[ ! -x "$bin/marrow-terrain" ] || check_command _marrow_terrain marrow-terrain.1 OPTIONS marrow-terrain
[ ! -x "$bin/marrow-viewer" ] || check_command _marrow_view marrow-viewer.1 OPTIONS marrow-viewer

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
touch scan.nrrd scan.nii info.txt
check_words "bone skin soft fat muscle" marrow scan.nii --type ""
check_words "skin soft" marrow scan.nii --type s
check_words "bone" marrow scan.nii --type = b
check_words "LPS RAS" marrow scan.nii --space =
check_words "otsu" marrow scan.nii --isovalue o
check_words "cpu" marrow scan.nii --device c
check_words "" marrow scan.nii --snap ""
check_words "scan.nrrd scan.nii" marrow sc
check_words "scan.nii" marrow -o scan.ni
check_words "info.txt info" marrow inf
check_words "info.txt" marrow sweep inf
check_words "sweep" marrow help s
check_words "--show-patient" marrow info --sh
check_words "--min-wall" marrow check --m
check_words "--measure" marrow-viewer --m
check_words "--exaggerate" marrow terrain --ex
# All presets are offered.
presets=$("$bin/marrow" --help | sed -nE 's/^Presets.*: (.*)\.$/\1/p' | tr ',' '\n' |
  awk '{print $1}' | xargs)
check_words "$presets" marrow scan.nii --type ""

if command -v zsh > /dev/null; then
  zsh -n "$packaging/completions/_marrow" || fault "zsh cannot read its completion"
fi
if command -v man > /dev/null; then
  for page in "$packaging"/man/*.1; do
    warnings=$(LC_ALL=C.UTF-8 man --warnings -l "$page" 2>&1 > /dev/null)
    [ -z "$warnings" ] || fault "$page: $warnings"
  done
fi
[ "$faults" -eq 0 ]
