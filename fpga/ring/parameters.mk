# Parameters of the ring board, in one place. `make quartus BOARD=ring ROLE=server` overrides them once.

# What is on the board, as the preset after "ring-": bus, node, node-tp, server, gateway
ROLE ?= node-tp

# The smallest device of this package that it fits into, by docs/ring-report.md: EP4CE6E22C8, EP4CE10E22C8,
# EP4CE15E22C8
device ?= $(if $(filter bus,$(ROLE)),EP4CE6E22C8,$\
            $(if $(filter gateway node-tp,$(ROLE)),EP4CE15E22C8,EP4CE10E22C8))

# Data bus towards the host, bits: 8, 16; a gateway has pins for 8. Also the data pins of the host bus.
dataBusWidth ?= 8

# Core clock, MHz: 50, 100; a gateway has 100
coreClockMhz ?= $(if $(filter server,$(ROLE)),50,100)

# Demodulator: 0 fast, 1 the published one, which counts
demodulator ?= 0

# Frames of the receive FIFO, and filters, of each CAN port
rxFrames ?= 64
filters  ?= 16

# What the generator gets of these.
BOARD_PARAMETERS := dataBusWidth coreClockMhz demodulator rxFrames filters
