#!/usr/bin/env bash
# What a package holds beside the program: man pages and completions, of the program's own making, and what
# Debian asks for.
#
#     bash docs/scripts/packaging.sh BLINN FOLDER
set -euo pipefail
blinn=$1 folder=$2
mkdir -p "$folder"
page() { "$blinn" man "$@" | gzip -9n >"$folder/$(IFS=-; echo "blinn${*:+-$*}").1.gz"; }
page
for command in $("$blinn" --help | sed -n 's/^  \([a-z]*\)  .*/\1/p' | grep -v -e '^blinn' -e '^help'); do
    page "$command"
done
page job openjd
page job slurm
"$blinn" completions bash >"$folder/blinn.bash"
"$blinn" completions zsh >"$folder/_blinn"
"$blinn" completions fish >"$folder/blinn.fish"

gzip -9nc CHANGELOG.md >"$folder/changelog.gz"
cat >"$folder/changelog" <<END
blinn ($("$blinn" --version | cut -d ' ' -f 2)-1) unstable; urgency=low

  * The program's own changes are in changelog.gz.

 -- ${DEBFULLNAME:-The blinn developers} <${DEBEMAIL:-blinn@localhost}>  $(git log -1 --format=%cD)
END
{
    cat LICENSE-MIT
    printf '\nOr, at your choice, the Apache License, Version 2.0: /usr/share/common-licenses/Apache-2.0.\n'
} >"$folder/copyright"
# It needs nothing of the machine it runs on.
echo 'blinn: shared-library-lacks-prerequisites [usr/bin/blinn]' >"$folder/lintian"
