#!/bin/sh
# Install what the lists name and this system lacks.
# usage: install.sh [-y] [--dry-run] LIST...     LIST: build, check, bench
set -eu
here=$(cd "$(dirname "$0")" && pwd)
yes=no
dry=no
lists=
for word in "$@"; do
    case $word in
    -y) yes=yes ;;
    --dry-run) dry=yes ;;
    *) lists="$lists $here/$word.txt" ;;
    esac
done

missing=
# shellcheck disable=SC2086,SC2013  # the lists are words
for package in $(sed 's/#.*//' $lists); do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null |
        grep -q 'install ok installed' || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

line="apt-get install -y --no-install-recommends$missing"
echo "missing packages:$missing"
if [ $dry = yes ]; then
    echo "would run: $line"
    exit 0
fi
if [ "$(id -u)" != 0 ]; then
    echo "not root; run this first:  sudo $line" >&2
    exit 1
fi
if [ $yes = no ]; then
    printf 'install them now? [y/N] '
    read -r answer || answer=n
    case $answer in
    y | Y | yes) ;;
    *)
        echo "nothing was installed; the line is:  $line" >&2
        exit 1
        ;;
    esac
fi
export DEBIAN_FRONTEND=noninteractive
echo "+ apt-get update"
apt-get update -qq
echo "+ $line"
# shellcheck disable=SC2086  # the packages are words
apt-get install -y -qq --no-install-recommends $missing
