//! ethercrab as the master of simulated slaves, those of `make_network.py`.
//!
//! Usage: `ethercrab-test INTERFACE CONTROL-SOCKET SCENARIO SLAVES [CYCLES]`. Prints a line per check; exit
//! code 1 if one is wrong.

mod stack;

use ethercrab::error::Error;
use ethercrab::subdevice_group::{DcConfiguration, Op};
use ethercrab::{
    Command, DcSync, MainDevice, MainDeviceConfig, PduStorage, SubDeviceGroup, Timeouts, std::ethercat_now,
};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};
use std::time::{Duration, Instant};

const MAX_SLAVES: usize = 8;
const PDI_BYTES: usize = 128;
static STORAGE: PduStorage<16, { PduStorage::element_size(1100) }> = PduStorage::new();

/// Bytes of outputs and inputs.
const SIZES: [(usize, usize); 5] = [(8, 8), (3, 5), (4, 2), (1, 1), (16, 16)];
const IDENTITY: (u32, u32, u32) = (0xF1F1_F1F1, 0x00F1_0001, 0x0001_0002);
const FIRST_ADDRESS: u16 = 0x1000;
/// Cycle of SYNC0.
const SYNC: Duration = Duration::from_millis(1);
const CORE_CYCLE_NS: f64 = 10.0;
/// Cycles until a slave's inputs show its outputs, at most.
const LAG: usize = 16;

const INIT: u16 = 1;
const PREOP: u16 = 2;
const SAFEOP: u16 = 4;
const OP: u16 = 8;
const ERROR: u16 = 0x10;

/// DL status: link, loop closed and communication of port 1.
const PORT_1: u16 = 1 << 5 | 3 << 10;
const PORT_1_OPEN: u16 = 1 << 5 | 2 << 10;
const PORT_1_CLOSED: u16 = 1 << 10;

type Group<S> = SubDeviceGroup<MAX_SLAVES, PDI_BYTES, ethercrab::DefaultLock, S>;
type Outcome = Result<(), String>;

/// Prints how a check went; a wrong one ends the scenario.
fn check(name: &str, ok: bool, detail: impl std::fmt::Debug) -> Outcome {
    if ok {
        println!("ok    {name}");
        Ok(())
    } else {
        Err(format!("{name}: {detail:x?}"))
    }
}

fn told<T>(what: &str, result: Result<T, Error>) -> Result<T, String> {
    result.map_err(|e| format!("{what}: {e}"))
}

/// The control socket of flyframe-cosim.
struct Simulator(BufReader<UnixStream>);

impl Simulator {
    fn ask(&mut self, line: &str) -> Outcome {
        self.told(line).map(|_| ())
    }

    fn told(&mut self, line: &str) -> Result<String, String> {
        let mut answer = String::new();
        writeln!(self.0.get_mut(), "{line}").map_err(|e| e.to_string())?;
        self.0.read_line(&mut answer).map_err(|e| e.to_string())?;
        match answer.trim().strip_prefix("ok") {
            Some(text) => Ok(text.to_string()),
            None => Err(format!("'{line}' answered by '{}'", answer.trim())),
        }
    }
}

/// The outputs of a cycle: the first byte tells which, the others depend on all.
fn pattern(slave: usize, cycle: usize) -> Vec<u8> {
    (0..SIZES[slave].0)
        .map(|i| if i == 0 { cycle as u8 } else { (cycle * 37 + slave * 11 + i * (cycle >> 3 | 1)) as u8 })
        .collect()
}

/// These outputs as the host program returns them.
fn looped(slave: usize, cycle: usize) -> Vec<u8> {
    let mut bytes = pattern(slave, cycle);
    bytes.resize(SIZES[slave].1, 0);
    bytes
}

struct Bus {
    master: &'static MainDevice<'static>,
    simulator: Simulator,
    slaves: usize,
}

impl Bus {
    /// `clocks`: frames that bring the clocks near to each other before anything else.
    fn new(interface: &str, control: &str, slaves: usize, clocks: u32) -> Result<Self, String> {
        let (tx, rx, pdus) = STORAGE.try_split().map_err(|_| "the PDU storage is taken")?;
        let config = MainDeviceConfig { dc_static_sync_iterations: clocks, ..Default::default() };
        let master = Box::leak(Box::new(MainDevice::new(pdus, Timeouts::default(), config)));
        let task = ethercrab::std::tx_rx_task(interface, tx, rx).map_err(|e| format!("{interface}: {e}"))?;
        smol::spawn(task).detach();
        let stream = UnixStream::connect(control).map_err(|e| format!("{control}: {e}"))?;
        Ok(Self { master, simulator: Simulator(BufReader::new(stream)), slaves })
    }

    fn full_wkc(&self) -> u16 {
        3 * self.slaves as u16 // 1 for reading, 2 for writing
    }

    async fn scan(&self) -> Result<Group<ethercrab::subdevice_group::PreOp>, String> {
        let group = told("scan", self.master.init_single_group::<MAX_SLAVES, PDI_BYTES>(ethercat_now).await)?;
        check(&format!("{} slaves are found", self.slaves), group.len() == self.slaves, group.len())?;
        Ok(group)
    }

    async fn to_op(&self) -> Result<Group<Op>, String> {
        let group = told("SAFEOP", self.scan().await?.into_safe_op(self.master).await)?;
        println!("ok    all reach SAFEOP");
        let sizes: Vec<_> =
            group.iter(self.master).map(|s| (s.outputs_raw().len(), s.inputs_raw().len())).collect();
        check("the mapping is that of the EEPROM", sizes == SIZES[..self.slaves], sizes)?;
        told("exchange", group.tx_rx(self.master).await)?;
        let group = told("OP", group.into_op(self.master).await)?;
        println!("ok    all reach OP");
        Ok(group)
    }

    async fn exchange(&self, group: &Group<Op>) -> Result<u16, String> {
        Ok(told("exchange", group.tx_rx(self.master).await)?.working_counter)
    }

    /// Process data cycles: working counters, and inputs that show the outputs of an earlier cycle, none of
    /// them torn.
    async fn cycle(&self, group: &Group<Op>, count: usize) -> Outcome {
        let wkc = self.full_wkc();
        let mut shown: Vec<Option<usize>> = vec![None; self.slaves];
        for c in 0..count {
            for (i, s) in group.iter(self.master).enumerate() {
                s.outputs_raw_mut().copy_from_slice(&pattern(i, c));
            }
            let got = self.exchange(group).await?;
            if got != wkc {
                return Err(format!("working counter of cycle {c}: {got} instead of {wkc}"));
            }
            for (i, s) in group.iter(self.master).enumerate() {
                let inputs = s.inputs_raw();
                let at = (c.saturating_sub(LAG - 1)..=c).rev().find(|&k| inputs[..] == looped(i, k)[..]);
                if at.is_none() && c < LAG {
                    continue; // what was there before
                }
                if at.is_none() || at < shown[i] {
                    return Err(format!(
                        "inputs of slave {i} in cycle {c}: {:02x?} after outputs {:02x?}",
                        &inputs[..],
                        pattern(i, c)
                    ));
                }
                shown[i] = at;
            }
        }
        let all = count < LAG || shown.iter().all(Option::is_some);
        check(&format!("{count} cycles with working counter {wkc}, outputs come back as inputs"), all, shown)
    }

    async fn register(&self, slave: usize, address: u16) -> Result<u16, String> {
        let value = Command::fprd(FIRST_ADDRESS + slave as u16, address).receive(self.master).await;
        told(&format!("register {address:#06x} of slave {slave}"), value)
    }

    async fn set_register(&self, slave: usize, address: u16, value: u16) -> Outcome {
        let sent = Command::fpwr(FIRST_ADDRESS + slave as u16, address).send(self.master, value).await;
        told(&format!("register {address:#06x} of slave {slave}"), sent)
    }

    async fn short_watchdogs(&self) -> Outcome {
        for i in 0..self.slaves {
            self.set_register(i, 0x0420, 50).await?; // 5 ms
        }
        Ok(())
    }

    /// AL status and AL status code of all slaves.
    async fn states(&self) -> Result<Vec<(u16, u16)>, String> {
        let mut states = Vec::new();
        for i in 0..self.slaves {
            states.push((self.register(i, 0x0130).await?, self.register(i, 0x0134).await?));
        }
        Ok(states)
    }

    /// Writes AL control of a slave and waits until AL status shows `state`.
    async fn request(&self, slave: usize, control: u16, state: u16) -> Outcome {
        self.set_register(slave, 0x0120, control).await?;
        let begin = Instant::now();
        while self.register(slave, 0x0130).await? != state {
            if begin.elapsed() > Duration::from_secs(5) {
                return Err(format!(
                    "slave {slave} does not reach state {state}: {:x?}",
                    self.states().await?
                ));
            }
        }
        Ok(())
    }

    /// Slaves whose watchdog has expired get their error acknowledged and go to OP again.
    async fn recover(&self, group: &Group<Op>) -> Outcome {
        for (i, (state, _)) in self.states().await?.into_iter().enumerate() {
            if state == SAFEOP | ERROR {
                self.request(i, SAFEOP | ERROR, SAFEOP).await?;
            }
            self.exchange(group).await?;
            self.request(i, OP, OP).await?;
        }
        Ok(())
    }
}

async fn scan(bus: &mut Bus) -> Outcome {
    let group = bus.scan().await?;
    for (i, s) in group.iter(bus.master).enumerate() {
        let identity = s.identity();
        check(&format!("slave {i}: name"), s.name() == format!("flyframe-io-{i}"), s.name())?;
        let triple = (identity.vendor_id, identity.product_id, identity.revision);
        check(
            &format!("slave {i}: identity"),
            triple == (IDENTITY.0, IDENTITY.1 + i as u32, IDENTITY.2),
            triple,
        )?;
        check(&format!("slave {i}: serial number"), identity.serial == 1000 + i as u32, identity.serial)?;
        check(&format!("slave {i}: alias"), s.alias_address() == 0x0100 + i as u16, s.alias_address())?;
    }
    Ok(())
}

async fn cycles(bus: &mut Bus, count: usize) -> Outcome {
    let group = bus.to_op().await?;
    let begin = Instant::now();
    bus.cycle(&group, count).await?;
    println!("      {} us per cycle", begin.elapsed().as_micros() / count as u128);
    let group = told("SAFEOP", group.into_safe_op(bus.master).await)?;
    let group = told("PREOP", group.into_pre_op(bus.master).await)?;
    told("INIT", group.into_init(bus.master).await)?;
    let states = bus.states().await?;
    check("all are back in INIT", states == vec![(INIT, 0); bus.slaves], states)
}

/// The first slave has four ports, with others behind all of them.
async fn star(bus: &mut Bus, count: usize) -> Outcome {
    let group = bus.to_op().await?;
    let mut links = Vec::new();
    for i in 0..bus.slaves {
        links.push(bus.register(i, 0x0110).await? >> 4 & 0xF);
    }
    check("the links are those of the star", links == [0xF, 1, 3, 1, 1], links)?;
    bus.cycle(&group, count).await
}

/// Crystals and cables differ: the master measures delays and starts SYNC0; then its frame is repeated, so
/// that simulated time goes faster. sync_pulses.py looks at the pulses.
async fn clocks(bus: &mut Bus, count: usize) -> Outcome {
    let mut group = bus.scan().await?;
    let text = bus.simulator.told("loops")?;
    let loops: Vec<f64> = text.split_whitespace().map(|ns| ns.parse().unwrap_or(f64::NAN)).collect();
    let truth: Vec<f64> = loops.iter().map(|ns| (loops[0] - ns) / 2.0).collect();
    let delays: Vec<u32> = group.iter(bus.master).map(|s| s.propagation_delay()).collect();
    println!("      delays {delays:?}, true {truth:?} ns");
    let near = delays.iter().zip(&truth).all(|(&d, &t)| (f64::from(d) - t).abs() <= CORE_CYCLE_NS);
    let all = truth.len() == delays.len();
    check("delays are those of frames on the mean within a core cycle", near && all, &delays)?;
    for mut s in group.iter_mut(bus.master) {
        s.set_dc_sync(DcSync::Sync0);
    }
    let group = told("FMMUs", group.into_pre_op_pdi(bus.master).await)?;
    let sync = DcConfiguration {
        start_delay: Duration::from_millis(100),
        sync0_period: SYNC,
        sync0_shift: Duration::ZERO,
    };
    let group = told("SYNC0", group.configure_dc_sync(bus.master, sync).await)?;
    let group = told("SAFEOP", group.into_safe_op(bus.master).await)?;
    told("exchange", group.tx_rx_dc(bus.master).await)?;
    let group = told("OP", group.into_op(bus.master).await)?;
    let wkc = told("exchange", group.tx_rx_dc(bus.master).await)?.working_counter;
    check("the clock's datagram does not disturb process data", wkc == bus.full_wkc(), wkc)?;
    bus.simulator.ask(&format!("repeat {count} {}", SYNC.as_micros()))
}

/// Cut in the middle of the line for longer than the watchdog, and mended.
async fn cable(bus: &mut Bus) -> Outcome {
    let group = bus.to_op().await?;
    bus.short_watchdogs().await?;
    bus.cycle(&group, 50).await?;
    let at = bus.slaves / 2;
    let port = bus.register(at - 1, 0x0110).await? & PORT_1;
    check("DL status of the slave before it: port 1 is open and communicates", port == PORT_1_OPEN, port)?;
    bus.simulator.ask(&format!("cut {at}"))?;
    for _ in 0..30 {
        let wkc = bus.exchange(&group).await?;
        if wkc != 3 * at as u16 {
            return Err(format!("with a cut before slave {at} the working counter is {wkc}"));
        }
        bus.simulator.ask("advance 300")?;
    }
    println!("ok    behind the cut nobody answers, before it all do");
    let port = bus.register(at - 1, 0x0110).await? & PORT_1;
    check("DL status of the slave before it: port 1 has no link and is closed", port == PORT_1_CLOSED, port)?;
    bus.simulator.ask(&format!("mend {at}"))?;
    bus.simulator.ask("advance 100")?;
    let wkc = bus.exchange(&group).await?;
    check("after mending all answer", wkc == bus.full_wkc(), wkc)?;
    let states = bus.states().await?;
    let wanted: Vec<_> =
        (0..bus.slaves).map(|i| if i < at { (OP, 0) } else { (SAFEOP | ERROR, 0x001b) }).collect();
    check(
        "those behind it are in SAFEOP by their watchdogs, the others still in OP",
        states == wanted,
        states,
    )?;
    bus.recover(&group).await?;
    bus.cycle(&group, 50).await
}

async fn refuse(bus: &mut Bus) -> Outcome {
    let group = told("FMMUs", bus.scan().await?.into_pre_op_pdi(bus.master).await)?;
    bus.simulator.ask("host 1 refuse safeop 0x001d")?;
    // By hand: `into_safe_op` gives up with a frame on its way, whose return ends ethercrab's receiving task.
    for i in 0..bus.slaves {
        bus.request(i, SAFEOP, if i == 1 { PREOP | ERROR } else { SAFEOP }).await?;
    }
    let states = bus.states().await?;
    let wanted: Vec<_> =
        (0..bus.slaves).map(|i| if i == 1 { (PREOP | ERROR, 0x001d) } else { (SAFEOP, 0) }).collect();
    check("the refusing slave stays in PREOP, with its AL status code", states == wanted, states)?;
    bus.simulator.ask("host 1 accept safeop")?;
    bus.request(1, PREOP | ERROR, PREOP).await?;
    bus.request(1, SAFEOP, SAFEOP).await?;
    println!("ok    after an acknowledge SAFEOP is reached");
    let group = told("SAFEOP", group.into_safe_op(bus.master).await)?;
    told("exchange", group.tx_rx(bus.master).await)?;
    let group = told("OP", group.into_op(bus.master).await)?;
    bus.cycle(&group, 50).await
}

async fn watchdog(bus: &mut Bus) -> Outcome {
    let group = bus.to_op().await?;
    bus.short_watchdogs().await?;
    bus.cycle(&group, 50).await?;
    bus.simulator.ask("advance 20000")?;
    let states = bus.states().await?;
    check(
        "without process data all fall to SAFEOP, with code 0x001b",
        states == vec![(SAFEOP | ERROR, 0x001b); bus.slaves],
        states,
    )?;
    bus.recover(&group).await?;
    bus.cycle(&group, 50).await
}

/// Slave 1 has an EEPROM with a wrong checksum.
async fn eeprom(bus: &mut Bus) -> Outcome {
    let group = bus.scan().await?;
    for i in 0..bus.slaves {
        let loaded = bus.register(i, 0x0110).await? & 1;
        check(
            &format!("slave {i}: the DL status tells whether the EEPROM is valid"),
            loaded == u16::from(i != 1),
            loaded,
        )?;
        let errors = bus.register(i, 0x0502).await? >> 11 & 3;
        check(
            &format!("slave {i}: so does the EEPROM status"),
            errors == if i == 1 { 3 } else { 0 },
            errors,
        )?;
    }
    let group = told("SAFEOP", group.into_safe_op(bus.master).await)?;
    let wkc = told("exchange", group.tx_rx(bus.master).await)?.working_counter;
    check("it takes no part in process data", wkc == bus.full_wkc() - 3, wkc)
}

/// Never ends, and has the program look at everything again every 10 ms or sooner. The clock that libfaketime
/// gives makes a thread that waits for a short time wait for ever (the kernel takes the end from another
/// clock): async-io's does so while another one looks at the network, and now and then neither of them does.
async fn heartbeat() -> Outcome {
    let waker = Arc::new(Mutex::new(None::<Waker>));
    let mine = waker.clone();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_micros(100)); // in a hundredth of the time
            if let Some(waker) = mine.lock().expect("nobody panics").take() {
                waker.wake();
            }
        }
    });
    std::future::poll_fn(|context| {
        *waker.lock().expect("nobody panics") = Some(context.waker().clone());
        Poll::Pending
    })
    .await
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [interface, control, scenario, slaves, ..] = args.as_slice() else {
        eprintln!("usage: ethercrab-test INTERFACE CONTROL-SOCKET SCENARIO SLAVES [CYCLES]");
        std::process::exit(2);
    };
    let count = args.get(4).map_or(10_000, |n| n.parse().expect("number of cycles"));
    let run = async {
        let slaves = slaves.parse().map_err(|_| "SLAVES is no number")?;
        let mut bus = Bus::new(interface, control, slaves, if scenario == "clocks" { 100 } else { 0 })?;
        match scenario.as_str() {
            "scan" => scan(&mut bus).await,
            "cycles" => cycles(&mut bus, count).await,
            "star" => star(&mut bus, count / 10).await,
            "clocks" => clocks(&mut bus, count).await,
            "cable" => cable(&mut bus).await,
            "refuse" => refuse(&mut bus).await,
            "watchdog" => watchdog(&mut bus).await,
            "eeprom" => eeprom(&mut bus).await,
            "stack" => stack::stack(&mut bus, count as u16).await,
            _ => Err(format!("no scenario is called '{scenario}'")),
        }
    };
    let outcome = smol::block_on(smol::future::or(run, heartbeat()));
    if let Err(what) = outcome {
        println!("WRONG {what}");
        std::process::exit(1);
    }
}
