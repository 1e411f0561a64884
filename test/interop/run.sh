#!/bin/sh
# Real masters on a virtual cable: starts flyframe-cosim at one end of a veth pair and a master at the other,
# in a network namespace of its own for each master, so that all run at once. Master gateway is SOEM with a
# gateway to a fibre ring, of flyframe-ring. Usage: run.sh [--preset NAME]
# [--masters "soem ethercrab gateway"] [--alarm NAME] [--star NAME] [--clocks NAME] [--written NAME]
# [--digital FILE] [--only SCENARIO] [--cycles N] [--sync-cycles N] [--transfers N] [--file BYTES]
# [--ring-cycles N] [--capture] [--simulator PROGRAM] [--ring PROGRAM]; the NAMEs: the same slave with a smoke
# detector, with four ports, with distributed clocks, with these and acknowledged by write; the FILE, without
# its ending: one with digital I/O. Scenario stack with SOEM is `make slave-demo`.
# The last line is "N passed, N failed, N skipped"; exit code 1 if something failed.
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=$root/build/interop
# A simulated network is far slower than a real one. So the clock of a master goes slower, too, and with it
# that of idle times in the simulation: a hundredth of the wall clock. Its time-outs are its defaults.
clock=0.01
preset=slave alarm= star= clocks= written= digital= masters='soem ethercrab gateway' only=
cycles=1000 sync=140 transfers=20 file=4001 ring_cycles=24
# A ring in RTL is slower still.
ring_clock=0.001
capture= simulator=$out/flyframe-cosim ring=$out/flyframe-ring master=
python=$root/build/tools/venv/bin/python
while [ $# -gt 0 ]; do
  case $1 in
    --preset) preset=$2; shift ;;
    --alarm) alarm=$2; shift ;;
    --star) star=$2; shift ;;
    --clocks) clocks=$2; shift ;;
    --written) written=$2; shift ;;
    --digital) digital=$2; shift ;;
    --masters) masters=$2; shift ;;
    --only) only=$2; shift ;;
    --cycles) cycles=$2; shift ;;
    --sync-cycles) sync=$2; shift ;;
    --transfers) transfers=$2; shift ;;
    --file) file=$2; shift ;;
    --ring-cycles) ring_cycles=$2; shift ;;
    --ring) ring=$2; shift ;;
    --capture) capture=yes ;;
    --simulator) simulator=$2; shift ;;
    --in-namespace) master=$2; shift ;; # this script's own
    *) sed -n '2,10s/^# //p' "$0" >&2; exit 2 ;;
  esac
  shift
done

faketime=$(ls /usr/lib/*/faketime/libfaketime.so.1 2>/dev/null)

# What runs a master; empty if it is not there.
command_of() {
  case $1 in
    soem)
      "$python" -c 'import pysoem' 2>/dev/null && echo "$python $here/soem_test.py" ;;
    gateway)
      "$python" -c 'import pysoem' 2>/dev/null && [ -x "$ring" ] && echo "$python $here/gateway.py" ;;
    ethercrab) [ -x "$out/ethercrab-test" ] && echo "$out/ethercrab-test" ;;
    *) echo "No master is called '$1'; known: soem, ethercrab, gateway." >&2; exit 2 ;;
  esac
}

# After 1,000 cycles clocks are locked; SYNC0 begins with the hundredth.
judge() {
  [ "$scenario" != stack ] || judge_mailbox || return 1
  [ "$scenario" = clocks ] || return 0
  settled=
  [ "$sync" -le 1100 ] || settled='--settled 900 --within 40'
  # shellcheck disable=SC2086 # options
  python3 "$here/sync_pulses.py" "$net/sync.txt" "$slaves" --out "$net/apart.txt" $settled
}

# Wireshark finds nothing wrong with what went through the mailboxes.
judge_mailbox() {
  messages=$(tshark -r "$net/frames.pcapng" -Y ecat_mailbox 2>/dev/null | wc -l)
  tshark -r "$net/frames.pcapng" -Y '_ws.malformed or _ws.expert.severity == "Error"' 2>/dev/null \
    >"$net/wrong"
  echo "      $messages frames with mailbox messages, $(wc -l <"$net/wrong") of all frames malformed"
  [ "$messages" -gt 100 ] && [ ! -s "$net/wrong" ]
}

# scenario SLAVES [options of make_network.py]
run() {
  scenario=$1 slaves=$2
  shift 2
  [ -z "$only" ] || [ "$only" = "$scenario" ] || return 0
  echo "--- $scenario, $slaves slaves"
  net=$out/$master/$scenario-$slaves
  python3 "$here/make_network.py" "$net" "$slaves" --preset "$preset" "$@" || exit 2
  second=
  [ "$scenario" = ring ] && second='--ring-interface veth-end'
  [ "$scenario" = clocks ] && second="--sync $net/sync.txt"
  rm -f "$net/ready"
  mkfifo "$net/ready"
  "$simulator" --network "$net/net.json" --interface veth-slaves --control "$net/control.sock" \
    --time-scale $clock $second >"$net/ready" 2>"$net/log" &
  cosim=$!
  if ! read -r line <"$net/ready"; then
    cat "$net/log"
    wait $cosim
    failed=$((failed + 1))
    return 0
  fi
  tshark=
  if [ -n "$capture" ] || [ "$scenario" = stack ]; then
    tshark -q -i veth-master -w "$net/frames.pcapng" 2>/dev/null &
    tshark=$!
    sleep 2
  fi
  limit=600 count=$cycles
  [ "$scenario" = cycles ] && limit=1800
  # A cycle of several slaves takes longer by as much.
  [ "$scenario" = cycles ] && [ "$slaves" -gt 1 ] && count=$(((cycles + 3) / 4))
  [ "$scenario" = clocks ] && limit=$((600 + sync)) count=$sync
  begin=$(date +%s)
  command=$program
  if [ "${scenario#stack}" != "$scenario" ]; then
    count=$transfers limit=$((600 + transfers + file / 100))
    [ "$master" != soem ] || command="$python $here/soem_stack.py" count="$transfers $file"
  fi
  # shellcheck disable=SC2086 # the command has arguments
  timeout $limit env LD_PRELOAD="$faketime" FAKETIME="+0 x$clock" \
    $command veth-master "$net/control.sock" "$scenario" "$slaves" $count
  ended=$?
  if [ -n "$tshark" ]; then
    sleep 1
    kill $tshark
    wait $tshark 2>/dev/null
  fi
  if [ $ended = 0 ] && judge; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
  fi
  echo "      took $(($(date +%s) - begin)) s"
  kill $cosim
  wait $cosim
  sed 's/^/      /' "$net/log" | tail -2
}

# The gateway in front of 8 nodes, which are simulated twice as fast with 50 MHz. Timers short, so that a
# break is shown soon.
run_gateway() {
  [ -z "$only" ] || [ "$only" = gateway ] || return 0
  echo "--- gateway, 8 nodes"
  net=$out/gateway/net
  mkdir -p "$net"
  nodes='{"address": 2}, {"address": 3}, {"address": 4}, {"address": 5}, {"address": 6}, {"address": 7}'
  nodes="$nodes, {\"address\": 8}, {\"address\": 9}"
  cat >"$net/ring.json" <<EOF
{"pd_ms": 5, "hello_ms": 5, "up_ms": 1, "each": {"preset": "ring-node-50"},
 "nodes": [{"address": 1, "preset": "ring-gateway", "host": "gateway",
 "eeprom": "../../verilog/ring-gateway.sii.bin"}, $nodes]}
EOF
  rm -f "$net/ready"
  mkfifo "$net/ready"
  "$ring" --network "$net/ring.json" --interface veth-slaves --control "$net/control.sock" \
    --state "$net/state" --processors 1 --time-scale $ring_clock >"$net/ready" 2>"$net/log" &
  cosim=$!
  begin=$(date +%s)
  # shellcheck disable=SC2086 # the command has arguments
  if read -r line <"$net/ready" && timeout 1800 env LD_PRELOAD="$faketime" FAKETIME="+0 x$ring_clock" \
    $program veth-master "$net/control.sock" 8 "$ring_cycles"; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
  fi
  echo "      took $(($(date +%s) - begin)) s"
  kill $cosim
  wait $cosim
  sed 's/^/      /' "$net/log" | tail -2
}

if [ -n "$master" ]; then
  program=$(command_of "$master")
  passed=0 failed=0
  ip link add veth-master type veth peer name veth-slaves || exit 2
  ip link add veth-back type veth peer name veth-end || exit 2
  for name in veth-master veth-slaves veth-back veth-end; do
    echo 1 >/proc/sys/net/ipv6/conf/$name/disable_ipv6
    ip link set "$name" up
  done
  if [ "$master" = gateway ]; then
    run_gateway
    echo "$passed $failed" >"$out/$master/result"
    exit 0
  fi
  for n in 1 3 5; do run scan $n; done
  run cycles 1
  # ethercrab takes twice as long; it has five slaves in `star`.
  most=5
  [ "$master" != ethercrab ] || most=3
  run cycles $most
  if [ "$master" = soem ]; then # ethercrab knows one layout only
    run overlap 3
    run lrd_lwr 3 --no-lrw
    [ -z "$alarm" ] || run alarm 3 --second "$alarm"
    [ -z "$digital" ] || run digital 5 --digital "$digital"
    run ring 3 --ring # ethercrab has one card only
    [ -z "$clocks" ] || run stack_sync 1 --stack --sync "$clocks"
    [ -z "$written" ] || run stack_sync 1 --stack --sync "$written"
  fi
  [ -z "$star" ] || run star 5 --star "$star"
  most=3
  [ "$sync" -le 1100 ] || most=5
  [ -z "$clocks" ] || run clocks $most --clocks "$clocks"
  run cable 3
  run refuse 3
  run watchdog 3
  run eeprom 3 --corrupt 1
  run stack 1 --stack
  [ -z "$written" ] || run stack 1 --stack --preset "$written"
  echo "$passed $failed" >"$out/$master/result"
  exit 0
fi

# In a namespace nothing can reach a real network, and no root is needed.
if ! unshare --user --net --map-root-user ip link add v0 type veth peer name v1 2>/dev/null; then
  echo "skipped: interoperability needs unshare, ip (iproute2), unprivileged user namespaces and veth"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
fi
if [ -z "$faketime" ]; then
  echo "skipped: interoperability needs libfaketime"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
fi
passed=0 failed=0 skipped=0 running=
for master in $masters; do
  program=$(command_of "$master")
  [ $? = 2 ] && exit 2
  if [ -z "$program" ]; then
    echo "skipped: $master is not there (make interop says why)"
    skipped=$((skipped + 1))
    continue
  fi
  mkdir -p "$out/$master"
  rm -f "$out/$master/result"
  unshare --user --net --map-root-user "$0" --in-namespace "$master" --preset "$preset" \
    ${alarm:+--alarm "$alarm"} ${star:+--star "$star"} ${clocks:+--clocks "$clocks"} \
    ${written:+--written "$written"} \
    ${digital:+--digital "$digital"} \
    ${only:+--only "$only"} --cycles "$cycles" --sync-cycles "$sync" --transfers "$transfers" --file "$file" \
    ${capture:+--capture} \
    --ring-cycles "$ring_cycles" --ring "$ring" --simulator "$simulator" 2>&1 | sed -u "s/^/$master: /" &
  running="$running $master"
done
wait
for master in $running; do
  if read -r p f <"$out/$master/result"; then
    passed=$((passed + p)) failed=$((failed + f))
  else
    failed=$((failed + 1)) # the script ended early
  fi
done
if [ "$passed$failed$skipped" = 000 ]; then
  echo "Nothing to run. Scenarios: scan, cycles, star, clocks, cable, refuse, watchdog, eeprom, stack;" \
    "only with soem: overlap, lrd_lwr, alarm, digital, ring, stack_sync; with gateway: gateway." >&2
  exit 2
fi
echo "$passed passed, $failed failed, $skipped skipped"
[ $failed = 0 ]
