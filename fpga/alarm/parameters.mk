# Parameters of the alarm board, in one place. `make quartus ROLE=master dataBusWidth=16` overrides them once.

# slave or master
ROLE ?= slave

# Data bus towards host and RAM, bits: 8, 16, 32. Also the data pins of the host bus.
dataBusWidth ?= 8

# Datagrams of a frame that are processed and appended: 1 to 128
maxSubTelegrams ?= 128

# Implemented bits of the node ID: 4 to 16
nodeIdWidth ?= 16

# 0: PHYs with MII; 3: with RMII, at both ports; 7: the same with linePorts 2
rmiiPorts ?= 0

# Ports of a master to its slaves: 1 a line; 2 a ring, with a data bus of 8 or 16 bits
linePorts ?= 1

# What the generator gets of these.
BOARD_PARAMETERS := dataBusWidth maxSubTelegrams nodeIdWidth rmiiPorts \
                    $(if $(filter master,$(ROLE)),linePorts)
