#!/usr/bin/env bash
# What a package holds beside the program: man pages and completions, of the program's own making.
#
#     bash docs/scripts/packaging.sh BLINN FOLDER
set -euo pipefail
blinn=$1 folder=$2
mkdir -p "$folder"
"$blinn" man | gzip -9n >"$folder/blinn.1.gz"
for command in $("$blinn" --help | sed -n 's/^  \([a-z]*\)  .*/\1/p' | grep -v '^blinn'); do
    [ "$command" = help ] || "$blinn" man "$command" | gzip -9n >"$folder/blinn-$command.1.gz"
done
"$blinn" completions bash >"$folder/blinn.bash"
"$blinn" completions zsh >"$folder/_blinn"
"$blinn" completions fish >"$folder/blinn.fish"
