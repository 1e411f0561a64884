# flyframe. `make help` lists the targets; each installs what it misses, or says in one line what to install.
ARGS   ?=
PRESET ?= cyclone4-min
FRAMES ?= 100000
SEED   ?= 1
BREAKS ?= 100
STEPS  ?= 10000000
EVENTS ?= 1000
CYCLES ?= 10000
SET    ?= smsoak
ACCESSES ?= 10000
HOSTS  ?=
# What `make test-changed` compares with: the commit before one's own, on branch main the last commit.
SINCE  ?= $(shell git merge-base HEAD main 2>/dev/null || echo HEAD)
PRESETS ?= cyclone4-min et1100 frame-processor

.DEFAULT_GOAL := help
include .ci/tools.mk
SIM := src/sim/sim.mk

SETS          ?= fuzz
SCHEDULER     ?=
PROGRAMS      ?=
CAMPAIGN      := PYTHONPATH=src $(VENV)/bin/python -m campaign
CAMPAIGN_ARGS  = --sets "$(SETS)" --frames "$(FRAMES)" --steps "$(STEPS)" \
                 --cycles "$(CYCLES)" --seed "$(SEED)" \
                 --scheduler "$(SCHEDULER)"
SHARD         := PYTHONPATH=src python3 -m campaign.shard

# The board, its role and parameters.
BOARD ?= alarm
$(if $(wildcard fpga/$(BOARD)/parameters.mk),,$(error BOARD is $(BOARD) but must be alarm or ring))
include fpga/$(BOARD)/parameters.mk
QUARTUS      ?= quartus_sh
BOARD_PRESET := $(BOARD)-$(ROLE)
BOARD_FLAGS  := $(foreach p,$(BOARD_PARAMETERS),--$(p) $($(p)))

.PHONY: help verilog generated check-generated test soak test-changed fuzz smsoak hosts can-fuzz faults \
        ring-plan transport-campaign relay-campaign campaign campaign-programs campaign-scheduler \
        campaign-worker campaign-record campaign-test alarm-latency page-latency cosim cosim-selftest \
        interop lint matrix \
        format check-format report ring-report figures pictures quartus check-board clean demo demo-ring \
        server \
        firmware-test stack-test alarm-sim alarm-ring-sim ring-sim ethercrab-test mutants \
        check-dependencies clocks slave-demo

# A text too long for its line goes on in the next, behind a backslash.
help: ## this text
	@sed -E ':more /\\$$/ { N; s/ *\\\n[ \t#]*/ /; b more }' $(MAKEFILE_LIST) | grep -E '^[a-z-]+:.*##' | \
	  sed -E 's/:.*## /\t/' | expand -t 20

verilog: tools-for-verilog ## Verilog of the default preset, or \
         # ARGS="--preset slave --ports 1 --name my_core"
	$(SBT) "run $(ARGS)"

generated: tools-for-generated ## Verilog of every preset; docs/registers.md, docs/parameters.md, docs/ring.md
	$(SBT) "run --all --docs docs"

check-generated: tools-for-check-generated ## generated/ and the generated pages of docs/ are what the \
                 # sources emit
	rm -rf build/check && mkdir -p build/check
	$(SBT) "run --all --out build/check/generated --docs build/check/docs"
	diff -r generated build/check/generated
	for f in registers parameters ring; do diff docs/$$f.md build/check/docs/$$f.md || exit 1; done

test: tools-for-test ## every kind of check once; the last line is "N passed, N failed"
	PATH="$(CURDIR)/build/tools/bin:$$PATH" .ci/run-tests $(SBT)

soak: tools-for-test ## the checks of `make test` that take samples, in full: docs/soak.md; of some \
      # suites: SUITES="OwnFramesSpec MutationModelSpec"
	PATH="$(CURDIR)/build/tools/bin:$$PATH" SUITES="$(SUITES)" .ci/run-soak $(SBT)

test-changed: tools-for-test ## the suites that a change may concern: SINCE=main
	PATH="$(CURDIR)/build/tools/bin:$$PATH" .ci/run-changed $(SINCE) $(SBT)

matrix: tools-for-matrix ## all parameter sets of the matrix only: elaboration, lint, rule tests, random \
        # frames
	FLYFRAME_TIER=soak $(SBT) "testOnly flyframe.cosim.MatrixSpec"

# PROGRAMS: those of a campaign, which are used as they are, instead of programs built from the sources.
fuzz: $(if $(PROGRAMS),,tools-for-fuzz) ## random frames of a preset or set of TestSets: \
      # FRAMES=1000000 SEED=7 PRESET=cyclone4-min
	$(if $(PROGRAMS),,$(SBT) "Test / runMain flyframe.campaign.Programs fuzz-$(PRESET) $(PRESET)")
	$(SHARD) --vectors build/fuzz.vectors $(or $(PROGRAMS),build/fuzz-$(PRESET)) $(PRESET) $(SEED) $(FRAMES)

smsoak: $(if $(PROGRAMS),,tools-for-smsoak) ## SyncManagers between bus and host at random: \
        # STEPS=10000000 SEED=1 SET=smsoak-wide
	$(if $(PROGRAMS),,$(SBT) "Test / runMain flyframe.campaign.Programs smsoak soak")
	$(SHARD) $(or $(PROGRAMS),build/smsoak) $(SET) $(SEED) $(STEPS)

hosts: tools-for-hosts ## hosts at the pins of every interface, good and bad: \
       # ACCESSES=1000000 SEED=1 HOSTS="hosts-spi-0 hosts-bus-16"
	$(SBT) "Test / runMain flyframe.cosim.HostPins $(ACCESSES) $(SEED) $(HOSTS)"

ring-plan: MHZ = 100
ring-plan: tools-for-ring-plan ## what a fibre ring can do: NODES=20 METRES=1200 MHZ=100
	@$(SBT) --error "runMain flyframe.RingPlan --nodes $(or $(NODES),0) --metres $(or $(METRES),0) --mhz $(MHZ)"

can-fuzz: tools-for-can-fuzz ## random CAN buses, a port in RTL against the golden model, in each cycle: \
          # FRAMES=1000000 SEED=7
	$(SBT) "rtl / Test / runMain flyframe.can.CanFuzz $(FRAMES) $(SEED)"

transport-campaign: tools-for-transport-campaign ## messages on a bus of 16 nodes with faults, each exactly \
                    # once, C and model mixed: MESSAGES=100000 SEED=1
	$(SBT) "base / Test / runMain flyframe.transport.TransportCampaign $(or $(MESSAGES),100000) $(SEED)"

relay-campaign: tools-for-relay-campaign ## breaks and mends of a fibre ring of 51 nodes in relay mode: \
                # BREAKS=10000 SEED=1
	$(SBT) "base / Test / runMain flyframe.relay.model.RelayCampaign $(BREAKS) $(SEED)"

faults: PRESET = slave
faults: tools-for-faults ## slaves in OP behind cables that fail: CYCLES=100000 SEED=1 \
        # ARGS="--ring --slaves 8"
	$(MAKE) -s -f $(SIM) build/faults/flyframe-faults COSIM_OUT=build/faults PRESETS=$(PRESET) COSIM_TRACE=0 \
	  COSIM_PROFILE=1
	build/faults/flyframe-faults --preset $(PRESET) --cycles $(CYCLES) --seed $(SEED) $(ARGS)

# Random frames and soak runs in shards on the workers of Dask: docs/campaign.md. SEED counts from the first
# shard on. The build is in the environment, as the campaign checks SETS and the other settings before it.
campaign campaign-programs: export CAMPAIGN_BUILD = \
  $(SBT) "Test / runMain flyframe.campaign.Programs campaign/programs $(SETS)"
campaign: tools-for-campaign ## long runs, resumable: FRAMES=1000000 SETS="cyclone4-min smsoak" \
          # STEPS=1000000 SCHEDULER=tcp://host:8786
	@$(CAMPAIGN) $(CAMPAIGN_ARGS) --build "$$CAMPAIGN_BUILD"

campaign-programs: tools-for-campaign-programs ## what a campaign's workers run, for SETS
	@PYTHONPATH=src python3 -m campaign.programs build/campaign/programs "$$CAMPAIGN_BUILD"

campaign-scheduler: tools-for-campaign-scheduler ## a scheduler for workers on several machines, at port 8786
	$(VENV)/bin/dask scheduler --port 8786

campaign-worker: tools-for-campaign-worker ## a worker for an existing scheduler, with the programs of this \
                 # checkout: SCHEDULER=tcp://host:8786
	@test -n "$(SCHEDULER)" || { echo "SCHEDULER is empty but must be like tcp://host:8786." >&2; exit 2; }
	PYTHONPATH=src $(VENV)/bin/dask worker $(SCHEDULER) --nworkers $$(nproc) --nthreads 1 --no-dashboard \
		--local-directory build/campaign

campaign-record: ## takes the shards that campaigns have finished into docs/campaigns.csv and docs/soak.md
	@PYTHONPATH=src python3 -m campaign.record

campaign-test: tools-for-campaign-test ## campaigns on a cluster of this machine, with killed workers and a \
               # defect
	$(SBT) "Test / runMain flyframe.campaign.Programs campaign-test mhz25"
	PYTHONPATH=src $(VENV)/bin/python test/campaign/test_campaign.py --processes 3

alarm-latency: tools-for-alarm-latency alarm-sim ## from detector to report, 5 slaves in RTL and 64 in the \
               # model, as JSON in build/: EVENTS=1000
	build/alarm/flyframe-alarm --measure $(EVENTS) --bus-cycle-us 100 --state build/alarm/measured \
	  >build/alarm/measured.json
	mv build/alarm/measured.json build/alarm-latency-rtl.json
	$(SBT) "rtl / Test / runMain flyframe.master.AlarmLatency $(EVENTS) build/alarm-latency.json"

page-latency: tools-for-page-latency ## from a report's arrival at the server to the page in Chromium, as \
              # JSON in build/: EVENTS=1000
	$(SBT) "server / Test / runMain flyframe.e2e.PageLatency $(EVENTS) build/page-latency.json"

cosim: tools-for-cosim ## C++ simulator with PRESETS="a b": build/flyframe-cosim, -fuzz, -latency
	$(MAKE) -s -f $(SIM) cosim PRESETS="$(PRESETS)"

cosim-selftest: tools-for-cosim-selftest ## the simulator against plain repeaters, without flyframe RTL
	$(MAKE) -s -f test/sim/test.mk cosim-selftest

demo: tools-for-demo alarm-sim ## the smoke-alarm system at work: a simulated line, the server with its \
      # page, a panel
	@mkdir -p build/demo
	@$(SBT) --error "export server / Runtime / fullClasspath" | tail -1 >build/demo/classpath
	@python3 demo/demo.py $(ARGS)

demo-ring: tools-for-demo-ring ring-sim ## a fibre ring of twelve nodes at work: fibres to cut, the server \
           # with its page, a panel, doors for CAN programs
	@mkdir -p build/demo-ring
	@$(SBT) --error "export server / Runtime / fullClasspath" | tail -1 >build/demo-ring/classpath
	@python3 demo/ring.py $(ARGS)

# The fastest simulator: without waveforms.
alarm-sim: tools-for-alarm-sim ## build/alarm/flyframe-alarm: master and slaves with their host programs
	$(MAKE) -s -f $(SIM) build/alarm/flyframe-alarm COSIM_OUT=build/alarm \
	  PRESETS="alarm-master alarm-slave" COSIM_TRACE=0

alarm-ring-sim: tools-for-alarm-ring-sim ## build/alarm-ring/flyframe-alarm: the same for a ring (--ring)
	$(SBT) "run --preset alarm-master --linePorts 2 --name alarm-master-ring --out build/alarm-ring/verilog" \
	  "run --preset alarm-slave --out build/alarm-ring/verilog"
	$(MAKE) -s -f $(SIM) build/alarm-ring/flyframe-alarm GENERATED=build/alarm-ring/verilog \
	  COSIM_OUT=build/alarm-ring PRESETS="alarm-master-ring alarm-slave" COSIM_TRACE=0

ring-sim: RING_PRESETS ?= ring-bus ring-node ring-node-tp ring-server
ring-sim: tools-for-ring-sim ## build/ring/flyframe-ring: a fibre ring with its host programs, doors for \
          # CAN programs: RING_PRESETS="ring-gateway ring-node"
	$(MAKE) -s -f $(SIM) build/ring/flyframe-ring COSIM_OUT=build/ring \
	  PRESETS="$(RING_PRESETS)" COSIM_TRACE=0

firmware-test: tools-for-firmware-test ## the host programs (src/firmware) against fake controllers
	$(MAKE) -s -f test/sim/test.mk firmware-test

stack-test: tools-for-stack-test ## the slave stack against a fake controller, under ASan and UBSan: \
            # MESSAGES=1000000 mutated ones, SEED=1
	$(MAKE) -s -f test/sim/test.mk stack-test $(if $(MESSAGES),MESSAGES=$(MESSAGES)) SEED=$(SEED)

server: tools-for-server ## server and page of the smoke-alarm system and of fibre rings: \
        # ARGS="--key FILE --http-port 8080", or ARGS=--help
	$(SBT) "server / runMain flyframe.server.Server $(ARGS)"

# A simulator of its own, the fastest: without waveforms.
interop: PRESET = slave
interop: ethercrab-test ## real masters (SOEM, ethercrab) on the simulated network: PRESET=slave \
         # ARGS="--only scan"
	$(SBT) "set run / fork := false" "run --preset $(PRESET) --out build/interop/verilog" \
	  "run --preset $(PRESET) --alarm 1 --name $(PRESET)-alarm --out build/interop/verilog" \
	  "run --preset $(PRESET) --ports 4 --name $(PRESET)-star --out build/interop/verilog" \
	  "run --preset $(PRESET) --clocks 2 --syncSignals 2 --meanWays 1 --name $(PRESET)-clocks \
	    --out build/interop/verilog" \
	  "run --preset $(PRESET) --clocks 2 --syncSignals 2 --acknowledgeByWrite 1 --name $(PRESET)-written \
	    --out build/interop/verilog" "run --preset digital-io --out build/interop/verilog" \
	  "run --preset ring-gateway --out build/interop/verilog" \
	  "run --preset ring-node --coreClockMhz 50 --name ring-node-50 --out build/interop/verilog"
	$(MAKE) -s -j2 -f $(SIM) build/interop/flyframe-cosim GENERATED=build/interop/verilog \
	  COSIM_OUT=build/interop PRESETS="$(PRESET) $(PRESET)-alarm $(PRESET)-star $(PRESET)-clocks \
	  $(PRESET)-written digital-io" COSIM_TRACE=0 COSIM_PROFILE=1
	$(MAKE) -s -j2 -f $(SIM) build/interop/flyframe-ring GENERATED=build/interop/verilog \
	  COSIM_OUT=build/interop PRESETS="ring-gateway ring-node-50" COSIM_TRACE=0
	test/interop/run.sh --preset $(PRESET) --alarm $(PRESET)-alarm --star $(PRESET)-star \
	  --clocks $(PRESET)-clocks --written $(PRESET)-written --digital build/interop/verilog/digital-io $(ARGS)

# The slave of the demonstration is preset slave with another EEPROM, made from its device file.
slave-demo: tools-for-interop ## the slave stack at work: an I/O device on the simulated network, served by \
            # SOEM, which also renews its firmware: ARGS="--transfers 1000"
	$(MAKE) -s -f $(SIM) build/slave-demo/flyframe-cosim COSIM_OUT=build/slave-demo PRESETS=slave COSIM_TRACE=0
	test/interop/run.sh --masters soem --only stack --simulator build/slave-demo/flyframe-cosim $(ARGS)

clocks: export COSIM_PROFILE = 1
clocks: ## pulses of SYNC0 for 11 s in slaves that real masters have set up, and in long lines: \
        # docs/clocks.md; takes hours
	$(MAKE) interop ARGS="--only clocks --sync-cycles 11200"
	$(SBT) "runMain flyframe.report.ClockPage"

lint: tools-for-lint ## verilator -Wall on generated/, and a plain Verilog reader
	test/sim/lint.sh generated
	@for f in generated/*.v; do yosys -q -p "read_verilog $$f" || exit 1; done
	@echo "plain Verilog: all files read"

format: tools-for-format ## formats the Scala sources
	$(SBT) scalafmtAll scalafmtSbt

check-format: tools-for-check-format ## fails if a Scala source is not formatted
	$(SBT) scalafmtCheckAll scalafmtSbtCheck

report: tools-for-report ## measures area, latencies and Fmax: docs/report.md, docs/report.json; times of \
        # the alarm system by alarm-latency and page-latency, if they have run here, else the last ones
	$(SBT) "runMain flyframe.report.Report"

ring-report: tools-for-ring-report ## the same for the fibre ring: docs/ring-report.md, \
             # docs/ring-report.json; its times and throughput by pictures
	$(SBT) "runMain flyframe.report.RingReport"

pictures: tools-for-test ## writes the pictures of docs/hosts.md, the plots of docs/ring.md and the times of \
          # docs/ring-report.md, as tests measure them
	FLYFRAME_PICTURES=write $(SBT) \
	  "testOnly flyframe.host.TimingPicturesSpec flyframe.ring.RingPicturesSpec" \
	  "runMain flyframe.report.RingReport times"

figures: tools-for-figures ## writes the figures of docs/report.json into the pages that show some, without \
         # measuring
	$(SBT) "runMain flyframe.report.Blocks"

quartus: tools-for-quartus ## compiles a board in Quartus: ROLE=master dataBusWidth=16, BOARD=ring; see \
         # fpga/alarm/parameters.mk, fpga/ring/parameters.mk
	@command -v $(QUARTUS) >/dev/null || \
	  { echo "Quartus is needed to compile the board, but $(QUARTUS) is not on PATH." >&2; exit 2; }
	$(SBT) "run --preset $(BOARD_PRESET) --name $(BOARD_PRESET) $(BOARD_FLAGS) --board \
	  --out build/board/$(ROLE)"
	$(QUARTUS) -t fpga/$(BOARD)/$(BOARD).tcl $(ROLE) $(dataBusWidth) $(device)

check-board: tools-for-check-board ## the boards without Quartus: netlist, pins, constraints, size, host bus \
             # in simulation
	$(SBT) "testOnly flyframe.board.*"

mutants: tools-for-mutants ## do the tests find deliberate defects (test/mutants)? \
         # ARGS="--check", "03 17", "--allowed 3"
	@test/mutants/run.py --sbt "$(SBT)" $(ARGS)

check-dependencies: tools-for-check-dependencies ## fails if a library is behind with a known advisory; see \
                    # .ci/check-dependencies
	@python3 .ci/check-dependencies

clean: ## removes everything built
	rm -rf build target project/target project/project test_run_dir

# A master that cannot be installed is skipped, one that does not compile is an error.
ethercrab-test: tools-for-interop
	@rm -f build/interop/ethercrab-test
	@if ! cargo --version 2>/dev/null | \
	    awk '{ split($$2, v, "."); ok = v[1] > 1 || v[2] >= 85 } END { exit !ok }'; then \
	  echo "ethercrab needs Rust 1.85 or newer (cargo), from https://rustup.rs."; \
	elif cargo fetch -q --offline --locked --manifest-path $(MASTERS)/Cargo.toml 2>/dev/null; then \
	  cargo build -q --release --offline --locked --target-dir build/interop/cargo \
	    --manifest-path $(MASTERS)/Cargo.toml && \
	  cp build/interop/cargo/release/ethercrab-test build/interop; fi
