# bash completion for birdseye, birdseyed and birdseye-sim: what the program's own --help tells of the command so far.
_birdseye() {
  local typed=${COMP_WORDS[COMP_CWORD]} word help offered=''
  local -a command=("${1##*/}")  # of the PATH: Tab starts no program of whatever folder one is in
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word =~ ^[a-z0-9][a-z0-9-]*$ ]] || break
    command+=("$word")
  done
  COMPREPLY=()
  help=$("${command[@]}" --help 2>/dev/null </dev/null) || return
  if [[ $typed == -* ]]; then
    offered=$(sed -n 's/^  \(-.*\)/\1/p' <<<"$help" | grep -oE '^(-[a-zA-Z],)?--[a-z0-9-]+' | sed 's/^-[a-zA-Z],//')
  elif [ ${#command[@]} = "$COMP_CWORD" ]; then
    offered=$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z0-9-]\{1,\}\).*/\1/p' <<<"$help")
  fi
  # What is neither a command nor an option is a file, which readline completes.
  mapfile -t COMPREPLY < <(compgen -W "$offered" -- "$typed")
}
complete -o default -F _birdseye birdseye birdseyed birdseye-sim
