#!/bin/sh
# The linker says the layers again: glintd and glint contain no Embree, no
# OpenImageIO and no C++; glint-worker contains no HTTP and no SQL.
# usage: check_programs.sh BIN_DIR
set -eu
bad=0
refuse() { # PROGRAM PATTERN
    if readelf -d "$1" | grep NEEDED | grep -Ei "$2"; then
        echo "$1 must not be linked with the above"
        bad=1
    fi
}
for program in glintd glint; do
    refuse "$1/$program" 'embree|OpenImageIO|libstdc|tbb'
done
refuse "$1/glint-worker" 'microhttpd|sqlite|curl|pq'
[ $bad -eq 0 ] && echo "programs ok"
exit $bad
