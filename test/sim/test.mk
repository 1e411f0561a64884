# The simulator's own tests, and those of the host programs that it runs:
#   make -f test/sim/test.mk cosim-selftest firmware-test
include src/sim/sim.mk

.PHONY: cosim-selftest firmware-test

# The simulator against plain repeaters: proves the simulator itself, without flyframe RTL.
cosim-selftest: build/selftest/eeprom-test
	$(MAKE) -f $(SIM)/sim.mk cosim GENERATED=test/sim/selftest COSIM_OUT=build/selftest \
	  PRESETS="repeater repeater-wide"
	build/selftest/eeprom-test
	python3 test/sim/selftest/run.py build/selftest

build/selftest/eeprom-test: build/selftest/eeprom_test.o $(SIM_OBJ)/core/eeprom.o
	$(CXX) -o $@ $^
build/selftest/%.o: test/sim/%.cpp
	$(call compile,$(CXX) $(SIM_CXXFLAGS))

# The host programs against fake controllers, and the tags of the simulator's server.
firmware-test: $(COSIM_OUT)/firmware-test
	$<
FIRMWARE_TESTS := $(wildcard test/firmware/*.cpp)
FIRMWARE_TEST  := $(patsubst test/firmware/%.cpp,$(COSIM_OUT)/firmware/test/%.o,$(FIRMWARE_TESTS))
$(COSIM_OUT)/firmware-test: $(FIRMWARE_TEST) $(FIRMWARE) $(SIM_OBJ)/alarm/ascon.o
	$(CXX) -o $@ $^
$(COSIM_OUT)/firmware/test/%.o: test/firmware/%.cpp
	$(call compile,$(CXX) $(SIM_CXXFLAGS) -I$(GENERATED))

-include $(wildcard build/selftest/*.d $(COSIM_OUT)/firmware/test/*.d)
