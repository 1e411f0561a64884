//! ethercrab as the master of the slave stack's demonstration (src/base/resources/devices/slave-demo.json).

use crate::{Bus, Outcome, check, told};
use ethercrab::error::{Error, MailboxError};

const OVERLOAD: u16 = 0x2310;
/// Mailbox to the master, and its SyncManager's status.
const MAILBOX: u16 = 0x1080;
const STATUS: u16 = 0x080d;
const FULL: u8 = 8;

fn refused<T: core::fmt::Debug>(what: &str, wanted: u32, result: Result<T, Error>) -> Outcome {
    let ok = match result {
        Err(Error::Mailbox(MailboxError::Aborted { code, .. })) => u32::from(code) == wanted,
        _ => false,
    };
    check(&format!("{what} is refused with {wanted:#010x}"), ok, result)
}

/// `transfers`: SDOs of each kind, at least one. Segmented ones are left out: ethercrab 0.7.1 does not know
/// the command of an upload segment's answer, 0. It has neither complete access nor FoE.
pub async fn stack(bus: &mut Bus, transfers: u16) -> Outcome {
    let group = bus.scan().await?;
    let s = told("slave", group.subdevice(bus.master, 0))?;
    check("the slave is the demonstration", s.name() == "flyframe-demo", s.name())?;
    let product: u32 = told("identity", s.sdo_read(0x1018, 2).await)?;
    check("product code by SDO and EEPROM", product == s.identity().product_id, product)?;
    for i in 0..transfers {
        told("expedited download", s.sdo_write(0x8000, 1, i).await)?;
        let back: u16 = told("expedited upload", s.sdo_read(0x8000, 1).await)?;
        let name: [u8; 42] = told("normal upload", s.sdo_read(0x1008, 0).await)?;
        if back != i || &name[..8] != b"flyframe" {
            check(&format!("transfer {i}"), false, (back, name))?;
        }
    }
    println!("ok    {transfers} transfers of each kind");
    refused("a value beyond its range", 0x0609_0031, s.sdo_write(0x8000, 3, 101u8).await)?;
    refused("an object that there is not", 0x0602_0000, s.sdo_read::<u8>(0x3000, 0).await)?;
    refused("a constant", 0x0601_0002, s.sdo_write(0x1000, 0, 1u32).await)?;
    told("mapping", s.sdo_write_array(0x1a00, [0x6010_0010u32, 0x6000_0110]).await)?;
    println!("ok    the mapping is changed");
    drop(s);
    let group = told("SAFEOP", group.into_safe_op(bus.master).await)?;
    let s = told("slave", group.subdevice(bus.master, 0))?;
    let sizes = (s.outputs_raw().len(), s.inputs_raw().len());
    check("SAFEOP with the new mapping", sizes == (3, 6), sizes)?;
    drop(s);
    told("exchange", group.tx_rx(bus.master).await)?;
    let group = told("OP", group.into_op(bus.master).await)?;
    for (outputs, inverted) in [(0x1234u16, 0x1234 ^ (transfers - 1)), (0x8000, 0x8000 ^ (transfers - 1))] {
        for _ in 0..4 {
            let s = told("slave", group.subdevice(bus.master, 0))?;
            s.outputs_raw_mut()[..2].copy_from_slice(&outputs.to_le_bytes());
            drop(s);
            let wkc = told("exchange", group.tx_rx(bus.master).await)?.working_counter;
            check("working counter", wkc == 3, wkc)?;
        }
        let s = told("slave", group.subdevice(bus.master, 0))?;
        let raw = s.inputs_raw();
        let (temperature, inputs) =
            (u16::from_le_bytes([raw[0], raw[1]]), u16::from_le_bytes([raw[2], raw[3]]));
        check(
            "temperature and inverted inputs",
            (temperature, inputs) == (215, inverted),
            (temperature, inputs),
        )?;
    }
    // ethercrab's own SDOs throw away what is in the mailbox before them: it is read by hand.
    let s = told("slave", group.subdevice(bus.master, 0))?;
    let mut full = 0;
    for _ in 0..20 {
        full = told("status", s.register_read::<u8>(STATUS).await)? & FULL;
        if full != 0 {
            break;
        }
    }
    check("output 15 overloads the device: a message waits", full != 0, full)?;
    let message: [u8; 128] = told("mailbox", s.register_read(MAILBOX).await)?;
    let code = u16::from_le_bytes([message[8], message[9]]);
    check("it is the emergency", message[7] >> 4 == 1 && code == OVERLOAD, &message[..16])?;
    let version: u32 = told("upload", s.sdo_read(0x2001, 0).await)?;
    check("SDOs go on in OP", version == 1, version)
}
