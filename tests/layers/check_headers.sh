#!/bin/sh
# Each header compiles alone, as C11 with every warning an error; those of
# image.h also as C++17.  usage: check_headers.sh ROOT
set -eu
cd "$1"
bad=0
for header in $(find core server cli -name '*.h' ! -path '*/web/*' | sort); do
    case $header in
    core/trace/embree.h) continue ;; # needs the flags of the Embree found
    esac
    # A header that is a body to be instantiated says so in its first line.
    if head -n 1 "$header" | grep -q 'include many times'; then
        continue
    fi
    if ! printf '#include "%s"\nextern int unit_is_not_empty;\n' "$header" |
        cc -std=c11 -D_GNU_SOURCE -Wall -Wextra -Wpedantic -Werror -I. \
            -fsyntax-only -x c -; then
        echo "$header does not compile alone"
        bad=1
    fi
done
printf '#include "core/image/image.h"\n' |
    c++ -std=c++17 -Wall -Wextra -Werror -I. -fsyntax-only -x c++ - || bad=1
[ $bad -eq 0 ] && echo "headers ok"
exit $bad
