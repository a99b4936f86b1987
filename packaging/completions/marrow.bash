# bash completion for marrow, marrow-terrain and marrow-viewer.
# A test compares the options with those of the programs.

_marrow_options() {
  local scan="--series --spacing --resample --volume --level"
  case $1 in
    info) echo "-h --help $scan --picture --headers --show-patient --json" ;;
    devices) echo "-h --help --json" ;;
    check) echo "-h --help --min-wall --strict --threads --json -q --quiet" ;;
    sweep)
      echo "-h --help --crop --median --blur --isotropic --from --to -n --samples --topology -o --output --plot --threads $scan" \
        "--json -q --quiet -v --verbose"
      ;;
    terrain)
      echo "-h --help --version -o --output --base --size --exaggerate --cell --levels --picture --threads" \
        "--json -q --quiet -v --verbose"
      ;;
    view) echo "-h --help --version --device $scan --measure" ;;
    *)
      echo "-h --help --version -o --output --picture --space --keep-patient --verify --json -q --quiet -v --verbose" \
        "--isovalue --type --open --snap --topology --trust --keep-thin --no-alarm --crop --median --blur --isotropic --largest --components" \
        "--clean-small --no-cavities --smooth --smooth-bound --keep --triangles --max-error" \
        "--labels --relax --only $scan --max-memory --device --threads"
      ;;
  esac
}

# The command of the line: its name, or nothing for extraction.
_marrow_command() {
  case ${COMP_WORDS[0]##*/} in
    marrow-terrain) echo terrain ;;
    marrow-viewer) echo view ;;
    *)
      if [ "$COMP_CWORD" -gt 1 ]; then
        case ${COMP_WORDS[1]} in info | check | sweep | devices | terrain | view) echo "${COMP_WORDS[1]}" ;; esac
      fi
      ;;
  esac
}

_marrow() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command
  # bash splits --option=value into three words.
  if [ "$current" = "=" ]; then
    current=
  elif [ "$previous" = "=" ]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  command=$(_marrow_command)
  COMPREPLY=()
  case $previous in
    help) mapfile -t COMPREPLY < <(compgen -W "info check sweep devices terrain view" -- "$current") ;;
    --type) mapfile -t COMPREPLY < <(compgen -W "bone skin soft fat muscle" -- "$current") ;;
    --device) mapfile -t COMPREPLY < <(compgen -W "cpu auto gpu" -- "$current") ;;
    --space) mapfile -t COMPREPLY < <(compgen -W "LPS RAS" -- "$current") ;;
    --isovalue) mapfile -t COMPREPLY < <(compgen -W "otsu" -- "$current") ;;
    --series | --spacing | --volume | --level | --threads | --max-memory | --snap | --crop | --median | --blur) ;;
    --isotropic | --components | --clean-small | --smooth | --keep | --triangles | --max-error | --relax) ;;
    --only | --min-wall | --from | --to | -n | --samples | --base | --size | --exaggerate | --cell | --levels) ;;
    *)
      if [[ $current == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(_marrow_options "$command")" -- "$current")
        return
      fi
      mapfile -t COMPREPLY < <(compgen -f -- "$current")
      if [ "$COMP_CWORD" -eq 1 ] && [ "${COMP_WORDS[0]##*/}" = marrow ]; then
        local commands
        mapfile -t commands < <(compgen -W "info check sweep devices terrain view help" -- "$current")
        COMPREPLY+=("${commands[@]}")
      fi
      ;;
  esac
}

complete -o filenames -F _marrow marrow marrow-terrain marrow-viewer
