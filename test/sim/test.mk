# The simulator's own tests, and those of the host programs that it runs:
#   make -f test/sim/test.mk cosim-selftest firmware-test stack-test transport-node node-port
include src/sim/sim.mk

.PHONY: cosim-selftest firmware-test stack-test transport-node

# The simulator against plain repeaters: proves the simulator itself, without flyframe RTL.
cosim-selftest: build/selftest/eeprom-test build/selftest/fibre-test
	$(MAKE) -f $(SIM)/sim.mk cosim GENERATED=test/sim/selftest COSIM_OUT=build/selftest \
	  PRESETS="repeater repeater-wide"
	build/selftest/eeprom-test
	build/selftest/fibre-test
	python3 test/sim/selftest/run.py build/selftest

build/selftest/eeprom-test: build/selftest/eeprom_test.o $(SIM_OBJ)/core/eeprom.o
	$(CXX) -o $@ $^
build/selftest/fibre-test: build/selftest/fibre_test.o $(SIM_OBJ)/ring/fibre.o
	$(CXX) -o $@ $^
build/selftest/%.o: test/sim/%.cpp
	$(call compile,$(CXX) $(SIM_CXXFLAGS))

# The host programs against fake controllers, and the tags of the simulator's server.
firmware-test: $(COSIM_OUT)/firmware-test
	$<
FIRMWARE_TESTS := $(wildcard test/firmware/*.cpp)
FIRMWARE_TEST  := $(patsubst test/firmware/%.cpp,$(COSIM_OUT)/firmware/test/%.o,$(FIRMWARE_TESTS))
$(COSIM_OUT)/firmware-test: $(FIRMWARE_TEST) $(sort $(FIRMWARE) $(RING_NODE))
	$(CXX) -o $@ $^
$(COSIM_OUT)/firmware/test/%.o: test/firmware/%.cpp
	$(call compile,$(CXX) $(SIM_CXXFLAGS) -I$(GENERATED))

# The slave stack with the demonstration's dictionary, and the gateway, against fake controllers; MESSAGES
# mutated ones, with SEED. Whatever ASan and UBSan find ends it.
MESSAGES     ?= 50000
SEED         ?= 1
SANITIZED    := -g -O1 -fsanitize=address,undefined -fno-sanitize-recover=all
STACK_OUT    := $(COSIM_OUT)/stack-test.d
STACK_C      := $(wildcard src/firmware/driver/*.c src/firmware/slave/*.c src/firmware/ring/*.c) \
                $(patsubst %,src/firmware/node/%.c, \
                  can_port ring_node ring_picture ring_conflict ring_gateway) \
                src/firmware/start_number.c generated/slave-demo.objects.c generated/ring-gateway.objects.c
STACK_CPP    := $(wildcard test/firmware/stack/*.cpp) test/firmware/fake.cpp
STACK_TEST   := $(patsubst %,$(STACK_OUT)/%.o,$(STACK_C) $(STACK_CPP))
STACK_INC    := -Isrc/firmware -Isrc/firmware/slave -Igenerated
stack-test: $(COSIM_OUT)/stack-test
	$< $(MESSAGES) $(SEED)
$(COSIM_OUT)/stack-test: $(STACK_TEST)
	$(CXX) $(SANITIZED) -o $@ $^
$(STACK_OUT)/%.c.o: %.c
	$(call compile,$(CC) $(filter-out -O2 -fexceptions,$(FIRMWARE_FLAGS)) $(SANITIZED) $(STACK_INC))
$(STACK_OUT)/%.cpp.o: %.cpp
	$(call compile,$(CXX) -std=gnu++17 -Wall -Wextra $(SANITIZED) $(STACK_INC))

# A node's transport, as a program that tests drive through its pipes, under ASan and UBSan.
RING_OUT     := $(COSIM_OUT)/transport-node.d
RING         := $(patsubst %.c,$(RING_OUT)/%.o,$(wildcard src/firmware/ring/*.c test/firmware/ring/*.c))
transport-node: $(COSIM_OUT)/transport-node
$(COSIM_OUT)/transport-node: $(RING)
	$(CC) $(SANITIZED) -o $@ $^
$(RING_OUT)/%.o: %.c
	$(call compile,$(CC) $(filter-out -O2 -fexceptions,$(FIRMWARE_FLAGS)) $(SANITIZED) -Isrc/firmware \
	  -Igenerated)

# The driver of a ring node's CAN port, likewise.
PORT         := $(patsubst %.c,$(RING_OUT)/%.o,src/firmware/node/can_port.c src/firmware/driver/registers.c \
                  test/firmware/node/port.c)
node-port: $(COSIM_OUT)/node-port
$(COSIM_OUT)/node-port: $(PORT)
	$(CC) $(SANITIZED) -o $@ $^

-include $(STACK_TEST:.o=.d) $(RING:.o=.d) $(PORT:.o=.d)
-include $(wildcard build/selftest/*.d $(COSIM_OUT)/firmware/test/*.d)
