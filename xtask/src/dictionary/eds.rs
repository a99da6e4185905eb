//! The electronic data sheet, CiA 306-1.
//!
//! `Factor` and `Unit` are no keys of CiA 306; python `canopen` reads them, other tools skip keys that they do not know.
//! Numbers of type REAL32 are written in decimal.

use std::fmt::Write as _;

use thud_firmware::dictionary::access::TPDOS;
use thud_firmware::dictionary::object::{OBJECTS, Object, Sub, hash, type_number};
use thud_firmware::dictionary::{PRODUCT_CODE, REVISION_NUMBER, settings};
use zencan_common::objects::{AccessType, DataType, ObjectCode, PdoMappable};

use super::defaults;

/// Objects that CiA 301 demands of every device; the others are optional.
const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];
/// Bit rates that CiA 306 knows, kbit/s.
const RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];
/// The one that the sensor speaks, kbit/s.
const RATE: u16 = 1000;

/// The file's text.
pub fn write() -> String {
    let mut text = String::new();
    head(&mut text).expect("writing to a string succeeds");
    for object in OBJECTS {
        one(&mut text, object).expect("writing to a string succeeds");
    }
    text
}

fn head(text: &mut String) -> std::fmt::Result {
    let [major, minor] = [REVISION_NUMBER >> 16, REVISION_NUMBER & 0xFFFF];
    writeln!(
        text,
        "; Written by `cargo xtask dictionary` from the firmware's object dictionary; changes here are lost.\n\
         ; Dictionary hash 0x{:08X}: a sensor whose object 0x2402:7 says the same is described by this file.\n\
         [FileInfo]\nFileName=thud.eds\nFileVersion={major}\nFileRevision={minor}\nEDSVersion=4.0\n\
         Description=thud impact sensor\nCreationTime=12:00AM\nCreationDate=01-01-2026\nCreatedBy=thud\n\
         ModificationTime=12:00AM\nModificationDate=01-01-2026\nModifiedBy=thud\n",
        hash()
    )?;
    writeln!(
        text,
        "[DeviceInfo]\nVendorName=thud\nVendorNumber=0x0\nProductName=thud impact sensor\nProductNumber=0x{PRODUCT_CODE:08X}\n\
         RevisionNumber=0x{REVISION_NUMBER:08X}\nOrderCode=thud"
    )?;
    for rate in RATES {
        writeln!(text, "BaudRate_{rate}={}", u8::from(rate == RATE))?;
    }
    // Granularity 0: PDO mappings are fixed.
    writeln!(
        text,
        "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=0\nDynamicChannelsSupported=0\nCompactPDO=0\n\
         GroupMessaging=0\nNrOfRXPDO=1\nNrOfTXPDO={TPDOS}\nLSS_Supported=1\n"
    )?;
    // No dummy entries can be mapped, since nothing can.
    writeln!(text, "[DummyUsage]")?;
    for number in 1..=7 {
        writeln!(text, "Dummy{number:04}=0")?;
    }
    let lines = [
        "Settings (0x2000 to 0x2004) take effect together when 1 is written to 0x2010:1.",
        "0x2011 says what was refused last, and why.",
        "TPDO 1, the alarm, has 0x000 + node id so that it wins against all but NMT.",
        "Write 0x180 + node id to 0x1800:1 where CiA 301 is to be kept to the letter.",
    ];
    writeln!(text, "\n[Comments]\nLines={}", lines.len())?;
    for (number, line) in (1..).zip(lines) {
        writeln!(text, "Line{number}={line}")?;
    }
    let own = |object: &Object| (0x2000..0x6000).contains(&object.index);
    list(text, "MandatoryObjects", |object| MANDATORY.contains(&object.index))?;
    list(text, "OptionalObjects", |object| !MANDATORY.contains(&object.index) && !own(object))?;
    list(text, "ManufacturerObjects", own)
}

fn list(text: &mut String, section: &str, belongs: impl Fn(&Object) -> bool) -> std::fmt::Result {
    let objects: Vec<u16> = OBJECTS.iter().filter(|object| belongs(object)).map(|object| object.index).collect();
    writeln!(text, "\n[{section}]\nSupportedObjects={}", objects.len())?;
    for (number, index) in (1..).zip(objects) {
        writeln!(text, "{number}=0x{index:04X}")?;
    }
    Ok(())
}

fn one(text: &mut String, object: &Object) -> std::fmt::Result {
    writeln!(text, "\n[{:04X}]\nParameterName={}", object.index, object.name)?;
    let code = match object.code {
        ObjectCode::Array => 8,
        ObjectCode::Record => 9,
        _ => {
            writeln!(text, "ObjectType=0x7")?;
            return object.subs.first().map_or(Ok(()), |sub| entry(text, object, sub));
        }
    };
    let counted = object.sub(0).is_some();
    writeln!(text, "ObjectType=0x{code}\nSubNumber={}", object.subs.len() + usize::from(!counted))?;
    if !counted {
        let highest = object.highest();
        writeln!(
            text,
            "\n[{:04X}sub0]\nParameterName=Highest sub-index supported\nObjectType=0x7\nDataType=0x0005\nAccessType=const\n\
             DefaultValue={highest}\nPDOMapping=0",
            object.index
        )?;
    }
    for sub in object.subs {
        writeln!(
            text,
            "\n[{:04X}sub{:X}]\nParameterName={}\nObjectType=0x{}",
            object.index,
            sub.sub,
            sub.name,
            if sub.kind == DataType::Domain { 2 } else { 7 }
        )?;
        entry(text, object, sub)?;
    }
    Ok(())
}

fn entry(text: &mut String, object: &Object, sub: &Sub) -> std::fmt::Result {
    let access = match (sub.access, sub.pdo) {
        (AccessType::Ro, _) => "ro",
        (AccessType::Wo, _) => "wo",
        (AccessType::Const, _) => "const",
        // A process value that comes in by RPDO.
        (AccessType::Rw, PdoMappable::Rpdo) => "rww",
        (AccessType::Rw, _) => "rw",
    };
    writeln!(text, "DataType=0x{:04X}\nAccessType={access}", type_number(sub.kind))?;
    if let Some((low, high)) = settings::limits(object.index, sub.sub) {
        writeln!(text, "LowLimit={low}\nHighLimit={high}")?;
    }
    if let Some(default) = defaults::default(object.index, sub) {
        writeln!(text, "DefaultValue={default}")?;
    }
    writeln!(text, "PDOMapping={}", u8::from(!matches!(sub.pdo, PdoMappable::None)))?;
    let (factor, unit) = sub.step();
    if factor != 1.0 {
        writeln!(text, "Factor={factor}")?;
    }
    if !unit.is_empty() {
        writeln!(text, "Unit={unit}")?;
    }
    Ok(())
}
