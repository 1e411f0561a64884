#!/bin/sh
# Verilates and compiles a preset, unless that has been done with the same content before, and prints the
# files to link. What is built lies in $SIM_CACHE/models/DIGEST and is never changed, so that programs and
# tests share it, also while they are built at the same time. sim.mk calls this and sets the variables.
# usage: model.sh PRESET
set -eu
verilog=$GENERATED/$1.v
json=$GENERATED/$1.json
top=$(printf %s "$1" | tr -c 'A-Za-z0-9' _)
trace=
[ "$COSIM_TRACE" = 0 ] || trace=--trace-fst
# Signals inside that the simulator reads.
levels=
! grep -q "optical_1_rx" "$verilog" || levels=$SIM/ring/levels.vlt
digest() { sha256sum | cut -c1-32; }

# The model depends on the Verilog (but not on the comments at its beginning), on what that may include, and
# on the tools.
model=$SIM_CACHE/models/$({
  awk 'begun || !/^\/\//{ begun = 1; print }' "$verilog"
  find "$GENERATED" -maxdepth 1 -name '*.vh' -exec cat {} +
  echo "$VERILATOR_INC" "$VERILATOR_FLAGS" $trace "$COSIM_OPT" "$COSIM_PROFILE"
  [ -z "$levels" ] || cat "$levels"
  $VERILATOR --version
} | digest)
mkdir -p "$model"
touch "$model"
exec 9>"$model/lock"
flock 9

# compile FLAGS: the model, as it has been Verilated
compile() {
  ${MAKE:-make} -s -C "$model" -f "V$top.mk" OBJCACHE="$(cd "$SIM" && pwd)/objcache" \
    OPT_FAST="$COSIM_OPT $*" OPT_SLOW=-O0 "V${top}__ALL.a" \
    >/dev/null
}
# The adapter depends on the description of the preset and on the type it implements, too.
adapter=$model/adapter-$({
  cat "$json" "$SIM/gen_adapter.py" "$SIM/core/model.h"
  echo "$CXX" "$SIM_CXXFLAGS"
} | digest)
adapt() {
  [ ! -e "$adapter.o" ] || return 0
  python3 "$SIM/gen_adapter.py" "$json" "$verilog" >"$adapter.cpp"
  $CXX $SIM_CXXFLAGS -DCOSIM_TRACE="$COSIM_TRACE" -I"$model" -c -o "$adapter.new" "$adapter.cpp"
  mv "$adapter.new" "$adapter.o"
}
# The compiler learns from a measurement of latency which branches are taken: frames, and idle time.
train() {
  compile -fprofile-generate
  adapt
  $CXX -fprofile-generate -o "$model/train" $TRAINER "$adapter.o" "$model/V${top}__ALL.a" -lpcap -lz \
    -pthread
  "$model/train" --preset "$1" >/dev/null
  rm "$model"/V*.o "$model"/V*.a "$model/train"
}

if [ ! -e "$model/model.a" ]; then
  $VERILATOR --cc --prefix "V$top" --top-module "$top" $trace $VERILATOR_FLAGS -I"$GENERATED" -Mdir "$model" \
    $levels "$verilog" >&2
  if [ "$COSIM_PROFILE" = 1 ]; then
    train "$1"
    compile -fprofile-use -Wno-missing-profile
  else
    compile
  fi
  rm -f "$model"/V*.o "$model"/V*.cpp "$model"/*.gch "$model"/*.gcda
  mv "$model/V${top}__ALL.a" "$model/model.a"
  # Models that nobody has asked for in three days are of an earlier Verilog.
  find "$SIM_CACHE/models" -mindepth 1 -maxdepth 1 -mtime +2 -exec rm -rf {} +
fi
adapt
echo "$adapter.o $model/model.a"
