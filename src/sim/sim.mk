# The simulator: C++ around Verilated presets. The top Makefile calls it; it also works alone:
#   make -f src/sim/sim.mk cosim PRESETS="cyclone4-min frame-processor"
# builds build/flyframe-{cosim,fuzz,latency}, each with all of PRESETS built in.
PRESETS         ?= cyclone4-min
GENERATED       ?= generated
COSIM_OUT       ?= build
# Waveforms (--trace) cost speed even when none is written: COSIM_TRACE=0 leaves them out.
COSIM_TRACE     ?= 1
# Optimization of the models: code that is small runs fastest, as a model is larger than a cache. -O0 compiles
# fastest and pays for a run of seconds. For runs of hours COSIM_PROFILE=1 optimizes models of slaves for what
# they do most of the time.
COSIM_PROFILE   ?= 0
COSIM_OPT       ?= $(if $(filter 1,$(COSIM_PROFILE)),-O2,-Os)

SIM             := src/sim
# What is compiled once for all programs, whoever builds them: objects and Verilated models.
SIM_CACHE       := build/sim

VERILATOR       ?= verilator
VERILATOR_ROOT  ?= $(shell $(VERILATOR) --getenv VERILATOR_ROOT 2>/dev/null)
VERILATOR_FLAGS ?= -O3 --x-assign fast --x-initial fast -Wno-lint -Wno-style
VERILATOR_INC   := $(VERILATOR_ROOT)/include
COSIM_CXXFLAGS  ?= -O2 -std=gnu++17 -Wall -Wextra
# The defines of the runtime must be those of the models: verilated.mk sets the same for --trace-fst.
RUNTIME_FLAGS   := -O2 -std=gnu++17 -faligned-new -w -I$(VERILATOR_INC) -I$(VERILATOR_INC)/vltstd \
                   -DVERILATOR=1 -DVM_COVERAGE=0 -DVM_SC=0 -DVM_TRACE=1 -DVM_TRACE_FST=1 -DVM_TRACE_VCD=0
SIM_CXXFLAGS    := $(COSIM_CXXFLAGS) -I$(SIM) -Isrc/firmware -Isrc/firmware/slave -Igenerated \
                   -isystem $(VERILATOR_INC) -isystem $(VERILATOR_INC)/vltstd -DVM_TRACE=1 -DVM_TRACE_FST=1
# As strict as for a microcontroller; but a program that the simulator ends is unwound (-fexceptions).
FIRMWARE_FLAGS  := -std=c99 -ffreestanding -Wall -Wextra -Wpedantic -Wconversion -Werror -O2 -fexceptions

# Other flags or another Verilator, other objects.
FLAGS_DIGEST    := $(shell { echo '$(CXX) $(SIM_CXXFLAGS) $(RUNTIME_FLAGS) $(CC) $(FIRMWARE_FLAGS)'; \
                     $(VERILATOR) --version; } | sha256sum | cut -c1-16)
SIM_OBJ         := $(SIM_CACHE)/objects/$(FLAGS_DIGEST)
RUNTIME         := $(patsubst %,$(SIM_OBJ)/runtime/%.o,verilated verilated_fst_c verilated_threads)
# The firmware includes headers of GENERATED, so that its objects belong to the program.
FIRMWARE        := $(patsubst src/firmware/%.c,$(COSIM_OUT)/firmware/%.o, \
                     $(wildcard src/firmware/*.c src/firmware/driver/*.c))
# The slave stack with the device of the demonstration, as host program "stack".
STACK           := $(patsubst src/firmware/%.c,$(COSIM_OUT)/firmware/%.o, \
                     $(wildcard src/firmware/driver/*.c src/firmware/slave/*.c src/firmware/demo/*.c)) \
                   $(COSIM_OUT)/firmware/slave-demo.objects.o
# The host programs of ring nodes, and of gateways.
RING_NODE       := $(patsubst src/firmware/%.c,$(COSIM_OUT)/firmware/%.o, \
                     $(wildcard src/firmware/driver/*.c src/firmware/slave/*.c src/firmware/ring/*.c \
                       src/firmware/node/*.c) \
                     src/firmware/start_number.c src/firmware/ascon.c) \
                   $(COSIM_OUT)/firmware/ring-gateway.objects.o
# A line per preset: the files to link.
MODELS          := $(patsubst %,$(COSIM_OUT)/models/%.link,$(PRESETS))
# The objects of folders of the simulator.
objects          = $(foreach f,$(1),$(patsubst $(SIM)/%,$(SIM_OBJ)/%.o,$(basename \
                     $(wildcard $(SIM)/$f/*.cpp $(SIM)/$f/*.c))))

.PHONY: cosim sim-force
cosim: $(patsubst %,$(COSIM_OUT)/flyframe-%,cosim fuzz latency)

# The programs, each with the folders it consists of.
$(COSIM_OUT)/flyframe-cosim:   $(call objects,core live network stack) $(STACK)
$(COSIM_OUT)/flyframe-fuzz:    $(call objects,core fuzz)
$(COSIM_OUT)/flyframe-latency: $(call objects,core latency)
$(COSIM_OUT)/flyframe-smsoak:  $(call objects,core smsoak)
$(COSIM_OUT)/flyframe-faults:  $(call objects,core faults)
$(COSIM_OUT)/flyframe-hosts:   $(call objects,core hosts) $(filter $(COSIM_OUT)/firmware/driver/%,$(FIRMWARE))
$(COSIM_OUT)/flyframe-alarm:   $(call objects,core board plant alarm) $(FIRMWARE)
$(COSIM_OUT)/flyframe-alarm:   private LIBRARIES := -lslirp

$(COSIM_OUT)/flyframe-ring:    $(call objects,core board live plant ring) $(RING_NODE)
$(COSIM_OUT)/flyframe-ring:    private LIBRARIES := -lslirp

PROGRAMS        := $(patsubst %,$(COSIM_OUT)/flyframe-%,cosim fuzz latency smsoak faults hosts alarm ring)
$(PROGRAMS): $(RUNTIME) $(MODELS) $(COSIM_OUT)/models/list
	$(CXX) -o $@ $(filter %.o,$^) $$(cat </dev/null $(MODELS)) $(LIBRARIES) -lpcap -lz -pthread

# Changes only with the list of presets, so that the programs are linked again then.
$(COSIM_OUT)/models/list: sim-force
	@mkdir -p $(@D); echo '$(PRESETS)' | cmp -s - $@ || echo '$(PRESETS)' > $@

# Which model belongs to a preset depends on content, so it is asked each time; the answer rarely changes.
export CXX VERILATOR VERILATOR_INC VERILATOR_FLAGS GENERATED COSIM_TRACE COSIM_OPT COSIM_PROFILE TRAINER SIM \
       SIM_CACHE SIM_CXXFLAGS
TRAINER         := $(if $(filter 1,$(COSIM_PROFILE)),$(call objects,core latency) $(RUNTIME))
$(COSIM_OUT)/models/%.link: $(GENERATED)/%.v $(GENERATED)/%.json $(TRAINER) sim-force
	+@mkdir -p $(@D) && $(SIM)/model.sh $* >$@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

# An object appears at once and whole, because another make may build the same one at the same time.
compile = mkdir -p $(@D) && $(1) -MMD -MP -MT $@ -MF $@.$$$$.d -c -o $@.$$$$ $< && \
          mv $@.$$$$.d $(@:.o=.d) && mv $@.$$$$ $@
$(COSIM_OUT)/firmware/%.o: src/firmware/%.c
	$(call compile,$(CC) $(FIRMWARE_FLAGS) -I$(GENERATED) -Igenerated -Isrc/firmware/slave)
$(COSIM_OUT)/firmware/%.o: generated/%.c
	$(call compile,$(CC) $(FIRMWARE_FLAGS) -Igenerated -Isrc/firmware/slave)
$(SIM_OBJ)/runtime/%.o: $(VERILATOR_INC)/%.cpp
	$(call compile,$(CXX) $(RUNTIME_FLAGS))
# Arguments, files, control lines: no simulated cycle waits for these, but their libraries take long to
# compile.
WAITED_FOR_ONCE := $(patsubst %,%/main,alarm faults fuzz hosts latency network ring smsoak) \
                   core/network_file ring/network_file ring/bench ring/doors alarm/network alarm/flood \
                   hosts/suite
$(SIM_OBJ)/%.o: $(SIM)/%.cpp
	$(call compile,$(CXX) $(SIM_CXXFLAGS) $(if $(filter $(WAITED_FOR_ONCE),$*),-O0))
$(SIM_OBJ)/%.o: $(SIM)/%.c
	$(call compile,$(CC) $(FIRMWARE_FLAGS))

.SECONDARY:
-include $(wildcard $(SIM_OBJ)/*/*.d $(COSIM_OUT)/firmware/*.d $(COSIM_OUT)/firmware/*/*.d)
