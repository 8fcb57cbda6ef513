#!/bin/sh
# Runs a program several times, half of them beside as many busy loops as there are processors, and compares what it prints but for seconds: no clock decides.
# usage: alike.sh <runs> <command...>
runs=$1
shift
first=$(mktemp) || exit 2
next=$(mktemp) || exit 2
busy=
trap 'kill $busy 2> /dev/null; rm -f "$first" "$next"' EXIT
plain() { sed -E -e 's/[a-z]+_s=[0-9.e+-]+//g' -e 's/0x[0-9a-f]+//g' "$1"; }
i=0
while [ $i -lt "$runs" ]; do
  if [ $i -eq $((runs / 2)) ]; then
    k=$(nproc)
    while [ "$k" -gt 0 ]; do
      while :; do :; done &
      busy="$busy $!"
      k=$((k - 1))
    done
  fi
  "$@" > "$next" 2>&1 || { cat "$next"; exit 1; }
  [ $i -gt 0 ] || cp "$next" "$first"
  plain "$first" > "$first.plain"
  plain "$next" > "$next.plain"
  if ! cmp -s "$first.plain" "$next.plain"; then
    echo "run $i differs:"
    diff "$first.plain" "$next.plain"
    rm -f "$first.plain" "$next.plain"
    exit 1
  fi
  rm -f "$first.plain" "$next.plain"
  i=$((i + 1))
done
grep -E "iterations|factored|type: " "$first"
echo "$runs runs alike"
