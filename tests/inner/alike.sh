#!/bin/sh
# Runs a program several times, half of them beside as many busy loops as there are processors, and compares what it
# prints but for seconds: no clock decides.
# usage: alike.sh <runs> <command...>
runs=$1
shift
folder=$(mktemp -d) || exit 2
busy=
trap 'kill $busy 2> /dev/null; rm -rf "$folder"' EXIT
cd "$folder" || exit 2
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
  "$@" > output 2>&1 || { cat output; exit 1; }
  sed -E -e 's/[a-z]+_s=[0-9.e+-]+//g' -e 's/0x[0-9a-f]+//g' output > next
  [ $i -gt 0 ] || cp next first
  cmp -s first next || { echo "run $i differs:"; diff first next; exit 1; }
  i=$((i + 1))
done
grep -E "iterations|factored|type: " first
echo "$runs runs alike"
