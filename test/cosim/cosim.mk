# The C++ network harness around the Verilated presets. Included by the top Makefile; also usable alone:
#   make -f test/cosim/cosim.mk cosim PRESETS="cyclone4-min frame-processor"
# builds build/flyframe-{cosim,fuzz,latency}, each with all of PRESETS built in.
PRESETS         ?= cyclone4-min
GENERATED       ?= generated
COSIM_OUT       ?= build
COSIM_OBJ       := $(COSIM_OUT)/cosim
COSIM_SRC       := test/cosim
COSIM_PROGRAMS  := $(COSIM_OUT)/flyframe-cosim $(COSIM_OUT)/flyframe-fuzz $(COSIM_OUT)/flyframe-latency

VERILATOR       ?= verilator
VERILATOR_ROOT  ?= $(shell $(VERILATOR) --getenv VERILATOR_ROOT 2>/dev/null)
# Waveforms (--trace) cost speed even when none is written: COSIM_TRACE=0 leaves them out.
COSIM_TRACE     ?= 1
VERILATOR_FLAGS ?= -O3 --x-assign fast --x-initial fast -Wno-lint -Wno-style
COSIM_VINC      := $(VERILATOR_ROOT)/include
# The defines of the runtime must be those of the models: the same switches as verilated.mk sets for --trace-fst.
COSIM_RTFLAGS   := -O2 -std=gnu++17 -faligned-new -w -I$(COSIM_VINC) -I$(COSIM_VINC)/vltstd \
                   -DVERILATOR=1 -DVM_COVERAGE=0 -DVM_SC=0 -DVM_TRACE=1 -DVM_TRACE_FST=1 -DVM_TRACE_VCD=0
COSIM_OPT       ?= -O2
COSIM_CXXFLAGS  ?= -O2 -std=gnu++17 -Wall -Wextra -MMD -MP
COSIM_INC       := -I$(COSIM_SRC) -isystem $(COSIM_VINC) -DVM_TRACE=1 -DVM_TRACE_FST=1 -DCOSIM_TRACE=$(COSIM_TRACE)
COSIM_RUNTIME   := $(patsubst %,$(COSIM_OBJ)/runtime/%.o,verilated verilated_fst_c verilated_threads)

COSIM_MAINS     := cosim_main fuzz_main latency_main eeprom_test
COSIM_SMSOAK    := $(filter smsoak%,$(basename $(notdir $(wildcard $(COSIM_SRC)/*.cpp))))
COSIM_ALARM     := $(filter alarm_%,$(basename $(notdir $(wildcard $(COSIM_SRC)/*.cpp))))
COSIM_COMMON    := $(filter-out $(COSIM_MAINS) $(COSIM_SMSOAK) $(COSIM_ALARM),$(basename $(notdir $(wildcard $(COSIM_SRC)/*.cpp))))
COSIM_OBJS      := $(patsubst %,$(COSIM_OBJ)/%.o,$(COSIM_COMMON))
COSIM_ADAPTERS  := $(patsubst %,$(COSIM_OBJ)/%/adapter.o,$(PRESETS))
COSIM_MODELS    := $(patsubst %,$(COSIM_OBJ)/%/model.a,$(PRESETS))
# Verilog name of a preset's top module: every non-alphanumeric is an underscore.
cosim_top        = $(shell printf %s '$(1)' | tr -c 'A-Za-z0-9' _)

.PHONY: cosim cosim-selftest cosim-force
cosim: $(COSIM_PROGRAMS)

$(COSIM_OUT)/flyframe-%: $(COSIM_OBJ)/%_main.o $(COSIM_OBJS) $(COSIM_ADAPTERS) $(COSIM_MODELS) $(COSIM_RUNTIME) $(COSIM_OBJ)/presets
	$(CXX) -o $@ $(filter %.o %.a,$^) -lpcap -lz -pthread

# SyncManagers between bus and host; more than these two files of the harness it does not need.
$(COSIM_OUT)/flyframe-smsoak: $(patsubst %,$(COSIM_OBJ)/%.o,$(COSIM_SMSOAK) model ethernet) $(COSIM_ADAPTERS) $(COSIM_MODELS) $(COSIM_RUNTIME) $(COSIM_OBJ)/presets
	$(CXX) -o $@ $(filter %.o %.a,$^) -lz -pthread

# The smoke-alarm system: the master and its slaves, with their host programs in C. PRESETS="alarm-master alarm-slave"
COSIM_FIRMWARE  := $(patsubst src/firmware/%.c,$(COSIM_OBJ)/firmware/%.o,$(wildcard src/firmware/*.c))
$(COSIM_OUT)/flyframe-alarm: $(patsubst %,$(COSIM_OBJ)/%.o,$(COSIM_ALARM)) $(COSIM_FIRMWARE) $(COSIM_OBJS) $(COSIM_ADAPTERS) $(COSIM_MODELS) $(COSIM_RUNTIME) $(COSIM_OBJ)/presets
	$(CXX) -o $@ $(filter %.o %.a,$^) -lslirp -lmbedcrypto -lpcap -lz -pthread

# As strict as for a microcontroller; but a program that the harness ends is unwound (-fexceptions).
FIRMWARE_FLAGS  := -std=c99 -ffreestanding -Wall -Wextra -Wpedantic -Wconversion -Werror -O2
$(COSIM_OBJ)/firmware/%.o: src/firmware/%.c
	@mkdir -p $(@D)
	$(CC) $(FIRMWARE_FLAGS) -fexceptions -MMD -MP -I$(GENERATED) -c -o $@ $<

# Changes only with the list of presets, so that the programs are linked again then.
$(COSIM_OBJ)/presets: cosim-force
	@mkdir -p $(@D); echo '$(PRESETS)' | cmp -s - $@ || echo '$(PRESETS)' > $@

# A copy that changes only if the content does: regenerating an equal preset costs no build.
$(COSIM_OBJ)/%/source.v: $(GENERATED)/%.v
	@mkdir -p $(@D); cmp -s $< $@ || cp $< $@

$(COSIM_OBJ)/%/model.a: $(COSIM_OBJ)/%/source.v $(wildcard $(GENERATED)/*.vh)
	$(VERILATOR) --cc --prefix V$(call cosim_top,$*) --top-module $(call cosim_top,$*) $(if $(filter 1,$(COSIM_TRACE)),--trace-fst) $(VERILATOR_FLAGS) \
	  -I$(GENERATED) -Mdir $(@D) $<
	$(MAKE) -s -C $(@D) -f V$(call cosim_top,$*).mk OPT_FAST="$(COSIM_OPT)" OPT_SLOW="-O0" V$(call cosim_top,$*)__ALL.a
	@mv $(@D)/V$(call cosim_top,$*)__ALL.a $@

$(COSIM_OBJ)/%/adapter.cpp: $(GENERATED)/%.json $(COSIM_OBJ)/%/source.v $(COSIM_SRC)/gen_adapter.py
	@mkdir -p $(@D)
	python3 $(COSIM_SRC)/gen_adapter.py $(wordlist 1,2,$^) > $@.new && mv $@.new $@

# The adapter needs the Verilated header, which appears beside the model.
$(COSIM_OBJ)/%/adapter.o: $(COSIM_OBJ)/%/adapter.cpp $(COSIM_OBJ)/%/model.a
	$(CXX) $(COSIM_CXXFLAGS) $(COSIM_INC) -I$(@D) -c -o $@ $<

$(COSIM_OBJ)/runtime/%.o: $(COSIM_VINC)/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(COSIM_RTFLAGS) -c -o $@ $<

$(COSIM_OBJ)/%.o: $(COSIM_SRC)/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(COSIM_CXXFLAGS) $(COSIM_INC) -Isrc/firmware -I$(GENERATED) -c -o $@ $<

# The harness against plain repeaters: proves the harness itself, without flyframe RTL.
cosim-selftest:
	$(MAKE) -f $(COSIM_SRC)/cosim.mk cosim GENERATED=$(COSIM_SRC)/selftest COSIM_OUT=build/selftest PRESETS="repeater repeater-wide"
	$(MAKE) -f $(COSIM_SRC)/cosim.mk build/selftest/eeprom-test COSIM_OUT=build/selftest
	build/selftest/eeprom-test
	python3 $(COSIM_SRC)/selftest/run.py build/selftest

$(COSIM_OUT)/eeprom-test: $(COSIM_OBJ)/eeprom_test.o $(COSIM_OBJ)/eeprom.o
	$(CXX) -o $@ $^

# The host programs against fake controllers.
$(COSIM_OUT)/firmware-test: $(patsubst test/firmware/%.cpp,$(COSIM_OBJ)/test-firmware/%.o,$(wildcard test/firmware/*.cpp)) $(COSIM_FIRMWARE)
	$(CXX) -o $@ $^ -lmbedcrypto
$(COSIM_OBJ)/test-firmware/%.o: test/firmware/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(COSIM_CXXFLAGS) -Isrc/firmware -I$(GENERATED) -c -o $@ $<
.PHONY: firmware-test
firmware-test: $(COSIM_OUT)/firmware-test
	$<

.SECONDARY:
-include $(wildcard $(COSIM_OBJ)/*.d $(COSIM_OBJ)/*/adapter.d $(COSIM_OBJ)/firmware/*.d $(COSIM_OBJ)/test-firmware/*.d)
