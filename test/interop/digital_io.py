"""SOEM and slaves without a processor: 32 outputs each, to which their 32 inputs are wired. A scenario of
soem_test.py."""

import struct

import pysoem

WATCHDOG_US = 5000  # as soem_test.py sets it
STEP_US = 250  # between two looks at the outputs
TICK_US = 100  # by which a watchdog may be late
STATE = pysoem.settings.timeouts.state


class Digital:
    """`check(name, ok, detail)` tells of each check; `wkc` is the full working counter."""

    def __init__(self, bus, check, wkc):
        self.bus, self.check, self.wkc = bus, check, wkc
        self.slaves = list(range(len(bus.master.slaves)))

    def pattern(self, cycle):
        return [(cycle * 0x01234567 + i * 0x11111111) & 0xFFFFFFFF for i in self.slaves]

    def write(self, cycle):
        for s, value in zip(self.bus.master.slaves, self.pattern(cycle)):
            s.output = struct.pack("<I", value)
        return self.bus.exchange()

    def inputs(self):
        return [struct.unpack("<I", s.input)[0] for s in self.bus.master.slaves]

    def outputs(self):
        """Their levels at the pins; None while they are not driven."""
        told = [self.bus.simulator.ask(f"outputs {i}") for i in self.slaves]
        return [None if t == "none" else int(t, 16) for t in told]

    def driven(self):
        return [i for i, value in enumerate(self.outputs()) if value is not None]

    def now_us(self):
        return int(self.bus.simulator.ask("time").split()[0]) / 1000

    def fall(self, who, act):
        """When the outputs of these have fallen, in us from now on, while `act` is done again and again."""
        begin, ends = self.now_us(), {}
        while len(ends) < len(who) and self.now_us() < begin + 3 * WATCHDOG_US:
            act()
            self.bus.simulator.ask(f"advance {STEP_US}")
            us, driven = self.now_us() - begin, self.driven()
            ends.update({i: us for i in who if i not in driven and i not in ends})
        return ends

    def check_times(self, name, ends, who):
        # A frame is on its way for less than 50 us.
        latest = WATCHDOG_US + TICK_US + STEP_US + 50
        late = sorted(ends) != who or any(us > latest for us in ends.values())
        print(f"      after {max(ends.values(), default=0):.0f} us, watchdog {WATCHDOG_US} us")
        self.check(name, not late, ends)

    def run(self, cycles):
        check, bus = self.check, self.bus
        for i, s in enumerate(bus.master.slaves):
            check(f"slave {i}: name", s.name == "flyframe-digital", s.name)
        bus.master.config_map()
        state = bus.master.state_check(pysoem.SAFEOP_STATE, STATE)
        check("AL status follows AL control: all reach SAFEOP", state == pysoem.SAFEOP_STATE, bus.states())
        sizes = [(len(s.output), len(s.input)) for s in bus.master.slaves]
        check("32 outputs and 32 inputs each", sizes == [(4, 4)] * len(self.slaves), sizes)
        got = self.write(1)
        check("SAFEOP: the full working counter", got == self.wkc, got)
        check("SAFEOP: no output is driven", self.driven() == [], self.outputs())
        bus.request(pysoem.OP_STATE, "OP")
        self.cycle(cycles)
        self.cut_cable()
        self.stopped_master()
        self.left_op()

    def cycle(self, cycles):
        for cycle in range(cycles):
            got = self.write(cycle)
            if got != self.wkc:
                self.check(f"working counter of cycle {cycle}", False, got)
            shown, wanted = self.outputs(), self.pattern(cycle)
            if shown != wanted:
                self.check(f"outputs of cycle {cycle}", False, f"{shown} instead of {wanted}")
            if cycle > 0 and self.inputs() != self.pattern(cycle - 1):
                self.check(f"inputs of cycle {cycle}", False, self.inputs())
        self.check(f"{cycles} cycles: outputs show at once, inputs are those of the cycle before", cycles > 1)

    def cut_cable(self):
        at = len(self.slaves) // 2
        behind = self.slaves[at:]
        self.write(6)
        self.bus.simulator.ask(f"cut {at}")
        ends = self.fall(behind, lambda: self.write(7))
        self.check_times("cut cable: outputs behind it fall within the watchdog's time", ends, behind)
        shown = self.outputs()
        self.check("cut cable: those before it stay", shown[:at] == self.pattern(7)[:at], shown)
        self.bus.simulator.ask(f"mend {at}")
        self.bus.simulator.ask("advance 100")
        got, shown = self.write(8), self.outputs()
        self.check("mended: all are back", got == self.wkc and shown == self.pattern(8), (got, shown))

    def stopped_master(self):
        ends = self.fall(self.slaves, lambda: None)
        self.check_times("stopped master: all outputs fall within the watchdog's time", ends, self.slaves)
        expired = [self.bus.register(i, 0x0440, 2) & 1 for i in self.slaves]
        self.check("the watchdogs have expired", expired == [0] * len(self.slaves), expired)
        self.write(9)
        shown = self.outputs()
        self.check("the master goes on: all outputs are back", shown == self.pattern(9), shown)

    def left_op(self):
        self.bus.master.state = pysoem.SAFEOP_STATE
        self.bus.master.write_state()
        self.check("OP is left: all outputs fall at once", self.driven() == [], self.outputs())
        got = self.write(10)
        self.check("SAFEOP: none is driven", got == self.wkc and self.driven() == [], (got, self.outputs()))
        self.write(10)
        self.check("SAFEOP: inputs still come", self.inputs() == [0] * len(self.slaves), self.inputs())
        self.bus.op()
        self.write(11)
        self.check("OP again", self.outputs() == self.pattern(11), self.outputs())
        for state, name in ((pysoem.SAFEOP_STATE, "SAFEOP"), (pysoem.INIT_STATE, "INIT")):
            self.bus.request(state, name)
        self.check("INIT: none is driven", self.driven() == [], self.outputs())
